//! Groups of unknowns in fits: their gradients are those of parameters along any direction, whatever parameters do to the
//! shape afterwards.

use std::sync::Arc;

use crate::common::*;
use drt_estimators::fit::{Evaluation, Fit, Group, GroupKind, GroupedScene, View};
use drt_estimators::loss::{Loss, Reference};
use drt_estimators::{Scene, Session, Settings, Unattended};
use drt_geom::procedural;
use drt_math::stats::Moments;
use drt_math::{Affine, Mat3, Vec3, vec3};
use drt_medium::Property;
use drt_motion::{GeometryChange, Parameter};

/// Evaluations, and samples of each pixel in one.
const SEEDS: u64 = 64;
const SPP: u32 = 192;

fn settings() -> Settings {
    Settings::default()
}

/// What the scene shows, with everything a little brighter.
fn view(scene: &Scene) -> View {
    let mut session = Session::new(scene, &[], &settings()).expect("a valid scene");
    session.run(64, &Unattended);
    let pixels = session.rendering().image.pixels.iter().map(|p| p.mean * 1.5).collect();
    View::new(0, Reference::new(FILM, pixels).expect("a picture"))
}

fn fit(scene: &Scene, parameters: &[Parameter], groups: Vec<Group>) -> Fit {
    posed(scene, parameters, groups, Vec::new())
}

/// As [`fit`], with the scene in a known pose.
fn posed(scene: &Scene, parameters: &[Parameter], groups: Vec<Group>, pose: Vec<Parameter>) -> Fit {
    let views = vec![View { pose, ..view(scene) }];
    let fit = Fit::new(scene.clone(), parameters.to_vec(), views, Loss::L2, settings());
    fit.and_then(|fit| fit.with_groups(groups)).expect("a valid fit")
}

/// A turn after all else.
fn turned(value: f64) -> Parameter {
    let turn = GeometryChange::Rotate { axis: vec3(0.3, 1.0, -0.2), pivot: vec3(0.1, 0.1, 0.0) };
    parameter("turned", value, vec![moves("ball", turn)])
}

/// How far the gradient by a group along a direction is from that by a parameter with this effect, in standard errors of the difference between
/// both by the same samples, and what such an error is as a part of the gradient; then with the coordinates of the direction changed.
fn compare(
    scene: &Scene,
    group: Group,
    direction: &[f64],
    wrong: &[f64],
    by_parameter: Parameter,
    after: &[Parameter],
    pose: &[Parameter],
) -> [[f64; 2]; 2] {
    let values: Vec<f64> = after.iter().map(|p| p.value).collect();
    let mut groups = posed(scene, after, vec![group], pose.to_vec());
    let mut all = vec![by_parameter];
    all.extend_from_slice(after);
    let mut parameters = posed(scene, &all, Vec::new(), pose.to_vec());
    let along = |seen: &Evaluation, direction: &[f64]| -> f64 {
        let gradient = seen.group_gradient(0);
        assert_eq!(gradient.len(), direction.len());
        gradient.iter().zip(direction).map(|(g, d)| g * d).sum()
    };
    let [mut own, mut faulty, mut other] = [(); 3].map(|()| Moments::default());
    for seed in 0..SEEDS {
        let seen = groups.evaluate(&values, SPP, seed, &Unattended).expect("valid").expect("seen");
        let [right, turned] = [direction, wrong].map(|direction| along(&seen, direction));
        let with: Vec<f64> = core::iter::once(0.0).chain(values.iter().copied()).collect();
        let seen = parameters.evaluate(&with, SPP, seed, &Unattended);
        let expected = seen.expect("valid").expect("seen").gradient()[0];
        own.push(right - expected);
        faulty.push(turned - expected);
        other.push(expected);
    }
    let size = other.mean().abs();
    [own, faulty].map(|differences| {
        let error = differences.standard_error();
        [differences.mean() / error, error / size]
    })
}

fn check([fair, planted]: [[f64; 2]; 2]) {
    assert!(fair[0].abs() < 4.0 && fair[1] < 0.07, "{fair:?} {planted:?}");
    assert!(planted[0].abs() > 5.0, "{planted:?}");
}

fn coordinates(vectors: &[Vec3]) -> Vec<f64> {
    vectors.iter().flat_map(|v| v.to_array()).collect()
}

/// A quarter of a turn.
fn turn_back(vectors: &[Vec3]) -> Vec<Vec3> {
    let turn = Mat3::rotation(vec3(0.3, 1.0, -0.2), 1.2);
    vectors.iter().map(|v| turn * *v).collect()
}

#[test]
fn vertices_before_a_turn() {
    let scene = surfaces(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6));
    let count = scene.shapes[0].mesh.positions.len();
    let field: Vec<Vec3> = (0..count).map(|_| vec3(1.0, 0.3, 0.2)).collect();
    let effect = moves("ball", GeometryChange::VertexVelocity(field.clone().into()));
    let group = Group::new("ball", &scene, &"ball", GroupKind::Vertices).expect("a shape");
    let along = parameter("along", 0.0, vec![effect]);
    let (own, wrong) = (coordinates(&field), coordinates(&turn_back(&field)));
    check(compare(&scene, group, &own, &wrong, along.clone(), &[turned(1.2)], &[]));
    // Known, in place of a parameter.
    let group = Group::new("ball", &scene, &"ball", GroupKind::Vertices).expect("a shape");
    check(compare(&scene, group, &own, &wrong, along, &[], &[turned(1.2)]));
}

#[test]
fn cages_before_a_turn() {
    let scene = surfaces(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6));
    let place = Affine { linear: Mat3::IDENTITY * 1.3, translation: vec3(0.1, 0.1, 0.0) };
    let cage = Arc::new(procedural::cube().transform(&place));
    let field: Vec<Vec3> = cage.positions.iter().map(|p| vec3(1.0, 0.2 * p.x, 0.0)).collect();
    let vertices = (0..).zip(field.iter().copied()).collect();
    let effect = moves("ball", GeometryChange::Cage { mesh: cage.clone(), vertices });
    let group = Group::new("cage", &scene, &"ball", GroupKind::Cage(cage)).expect("a cage");
    let along = parameter("along", 0.0, vec![effect]);
    let (own, wrong) = (coordinates(&field), coordinates(&turn_back(&field)));
    check(compare(&scene, group, &own, &wrong, along, &[turned(1.2)], &[]));
}

/// Voxels are those of the file: the density's scale is not in them.
#[test]
fn voxels_of_a_scaled_density() {
    let scene = smoke(0.2);
    let group = Group::new("smoke", &scene, &"smoke", GroupKind::Voxels(Property::SigmaT));
    let group = group.expect("a grid");
    let own = group.values(&scene);
    let wrong: Vec<f64> = own.iter().map(|v| 1.3 * v).collect();
    let scales = parameter(
        "scales",
        0.0,
        vec![changes("smoke", "sigma_t", drt_math::ValueChange::Multiply(1.0))],
    );
    check(compare(&scene, group, &own, &wrong, scales, &[], &[]));
}

/// The mean cosines of a phase function, which are voxels as well.
#[test]
fn voxels_of_mean_cosines() {
    let [scene, _] = varied_smoke(1.0).map(in_the_sun);
    let group = Group::new("smoke", &scene, &"smoke", GroupKind::Voxels(Property::G));
    let group = group.expect("a grid");
    let own: Vec<f64> = group.values(&scene).iter().map(|v| 0.6 * v).collect();
    let wrong: Vec<f64> = own.iter().map(|v| 1.3 * v).collect();
    let op = drt_math::ValueChange::Multiply(0.6);
    let scales = parameter("scales", 0.0, vec![changes("smoke", "g", op)]);
    check(compare(&scene, group, &own, &wrong, scales, &[], &[]));
}

#[test]
fn values_do_not_remember_the_way() {
    let scene = surfaces(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6));
    let group = Group::new("ball", &scene, &"ball", GroupKind::Vertices).expect("a shape");
    let start = group.values(&scene);
    let at = |step: f64| -> Vec<f64> { start.iter().map(|v| v * (1.0 + step)).collect() };
    let [mut once, mut often] = [(); 2].map(|()| fit(&scene, &[], vec![group.clone()]));
    once.set_group(0, &at(0.1)).expect("valid values");
    for step in [0.3, -0.2, 0.1] {
        often.set_group(0, &at(step)).expect("valid values");
        let seen = often.evaluate(&[], 2, 1, &Unattended).expect("valid").expect("seen");
        assert!(seen.group_gradient(0).iter().all(|g| g.is_finite()));
    }
    let [a, b] = [once, often].map(|mut fit| {
        let seen = fit.evaluate(&[], 4, 9, &Unattended).expect("valid").expect("seen");
        (seen.loss(), seen.group_gradient(0).to_vec())
    });
    assert_eq!(a, b);
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let scene = surfaces(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6));
    let vertices = || Group::new("ball", &scene, &"ball", GroupKind::Vertices).expect("a shape");
    let no_grid = Group::new("ball", &scene, &"ball", GroupKind::Voxels(Property::Albedo));
    let message = no_grid.err().map(|e| e.to_string());
    assert_eq!(message.as_deref(), Some("group `ball`: its target has no such values"));
    let twice = vec![vertices(), Group { name: "again".into(), ..vertices() }];
    let fit = || Fit::new(scene.clone(), vec![], vec![view(&scene)], Loss::L2, settings()).unwrap();
    let mut both = fit().with_groups(twice).expect("each has its gradient");
    let message = both.set_group(1, &vertices().values(&scene)).err().map(|e| e.to_string());
    assert_eq!(message.as_deref(), Some("group `again`: group ball changes the same values"));
    let mut one = fit().with_groups(vec![vertices()]).expect("a valid fit");
    assert!(one.set_group(1, &[]).is_err() && one.set_group(0, &[1.0]).is_err());
    let mut values = vertices().values(&scene);
    values[5] = f64::NAN;
    let message = one.set_group(0, &values).err().map(|e| e.to_string());
    assert_eq!(message.as_deref(), Some("group `ball`: a value is NaN"));
}

/// Values depend on what was set last alone: set back, everything has the bits that it had; of what cannot be set nothing
/// changes.
#[test]
fn values_are_those_that_were_set_last() {
    let scene = surfaces(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6));
    let groups = Group::all(&scene);
    let names: Vec<String> = groups.iter().map(|group| group.name.clone()).collect();
    assert!(names.iter().any(|name| name == "ball.vertices"), "{names:?}");
    for group in &groups {
        assert_eq!(group.shape(&scene).iter().product::<usize>(), group.count(&scene));
    }
    let ball = names.iter().position(|name| name == "ball.vertices").expect("a ball");
    let mut grouped = GroupedScene::new(scene.clone(), groups);
    let start = grouped.values(ball).expect("a group").into_owned();
    let bits = |grouped: &GroupedScene| -> Vec<u64> {
        let values = grouped.groups()[ball].values(grouped.scene());
        values.iter().map(|v| v.to_bits()).collect()
    };
    let before = bits(&grouped);
    let moved: Vec<f64> = start.iter().map(|v| v + 0.1).collect();
    grouped.set(&[(ball, &moved)]).expect("finite values");
    assert_ne!(bits(&grouped), before);
    let once = bits(&grouped);
    for wrong in [&moved[1..], &vec![f64::NAN; moved.len()]] {
        assert!(grouped.set(&[(ball, &start), (ball, wrong)]).is_err());
        assert_eq!(bits(&grouped), once);
    }
    assert!(grouped.set(&[(ball, &start), (names.len(), &[])]).is_err());
    assert_eq!(bits(&grouped), once);
    grouped.set(&[(ball, &start)]).expect("finite values");
    assert_eq!(bits(&grouped), before);
}
