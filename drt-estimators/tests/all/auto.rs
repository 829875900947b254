//! The estimator that a pilot chooses: it is one of those that have names, bit for bit, with little work in the pilot.

use crate::common::*;
use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::fit::{Fit, Group, GroupKind, View};
use drt_estimators::loss::{Loss, Reference};
use drt_estimators::{
    EstimatorKind, Named, PathSampling, Rendering, Scene, SceneEmitter, Session, Settings,
    Surrounding, Unattended,
};
use drt_geom::procedural;
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

fn settings(estimator: EstimatorKind) -> Settings {
    Settings { estimator, threads: 1, expected_spp: 1 << 10, ..Settings::default() }
}

fn run(scene: &Scene, parameters: &[Parameter], settings: &Settings) -> Rendering {
    let mut session = Session::new(scene, parameters, settings).unwrap();
    assert!(session.run(8, &Unattended));
    session.rendering()
}

fn same(a: &Rendering, b: &Rendering) -> bool {
    let layers = |r: &Rendering| r.derivatives.iter().map(|d| d.total.clone()).collect::<Vec<_>>();
    let pixels = |r: &Rendering| {
        let all = layers(r).into_iter().flat_map(|layer| layer.pixels);
        all.map(|p| [p.mean, p.stderr]).collect::<Vec<_>>()
    };
    pixels(a) == pixels(b)
}

/// A ball over a floor under a lamp and a sky.
fn room() -> Scene {
    by_box_filter(surfaces_in_extended_light(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6)))
}

/// With a filter that jumps at the borders of pixels, which are edges to `path-space`.
fn by_box_filter(mut scene: Scene) -> Scene {
    let sensor = &mut scene.sensors[0].item.sensor;
    *sensor = sensor.clone().with_filter(Filter::new(FilterKind::BOX).unwrap());
    scene
}

fn camera_moves() -> Vec<Parameter> {
    vec![parameter("camera", 0.0, vec![moves("sensor[0]", GeometryChange::Translate(Vec3::X))])]
}

#[test]
fn what_is_chosen_is_the_named_estimator() {
    let (scene, parameters) = (room(), camera_moves());
    let chosen = run(&scene, &parameters, &settings(EstimatorKind::Auto));
    let why = chosen.plan.estimator.clone().unwrap();
    let (name, works) =
        why.split_once(": a pilot measured the work of each, with the least as 1: ").unwrap();
    // `path-space` stays where little more than noise tells it from another one, and no other is chosen without the least work.
    let work_of = |name: &str| -> f64 {
        let (_, after) = works.split_once(&format!("{name} ")).unwrap();
        after.split([',', ';']).next().unwrap().parse().unwrap()
    };
    let most = if name == "path-space" { 2.0 } else { 1.0 };
    assert!(work_of(name) <= most && work_of("warped") > 10.0, "{why}");
    let short = Settings { expected_spp: 1, ..settings(EstimatorKind::Auto) };
    let without = run(&scene, &parameters, &short).plan.estimator.unwrap();
    assert_eq!(without, "path-space: the run is too short for a pilot");
    for (kind, named) in [
        (EstimatorKind::PathSpace, "path-space"),
        (EstimatorKind::Radiative, "radiative"),
        (EstimatorKind::Warped, "warped"),
    ] {
        let by_name = run(&scene, &parameters, &settings(kind));
        assert_eq!(same(&chosen, &by_name), name == named, "{why}");
    }
    let threads = Settings { threads: 3, ..settings(EstimatorKind::Auto) };
    let again = run(&scene, &parameters, &threads);
    assert!(same(&chosen, &again) && again.plan.estimator == Some(why));
}

#[test]
fn what_refuses_is_not_chosen() {
    // Light paths and `radiative` do not go together, and without parameters nothing is chosen.
    let both = Settings { sampling: PathSampling::Bidirectional, ..settings(EstimatorKind::Auto) };
    let why = run(&room(), &camera_moves(), &both).plan.estimator.unwrap();
    assert!(!why.contains("radiative"), "{why}");
    assert_eq!(run(&room(), &[], &settings(EstimatorKind::Auto)).plan.estimator, None);
    // Past smooth surfaces there is no choice.
    let mut mirror = room();
    mirror.bsdfs[0].item = drt_estimators::surface::Bsdf::Conductor(Default::default());
    mirror.emitters.retain(|e| !e.item.emitter.is_delta());
    let why = run(&mirror, &camera_moves(), &settings(EstimatorKind::Auto)).plan.estimator.unwrap();
    assert!(why.contains("warped") && why.contains("smooth"), "{why}");
    // What all refuse is refused as `path-space` does.
    let light = Emitter::Point { position: vec3(0.0, 0.5, 0.0), intensity: Rgb::ONE };
    let (emitter, medium) = (light, Surrounding::Counted);
    mirror.emitters.push(Named::new("bulb", SceneEmitter { emitter, medium }));
    mirror.bsdfs.push(Named::new("veil", drt_estimators::surface::Bsdf::Null));
    let refusal =
        |kind| Session::new(&mirror, &camera_moves(), &settings(kind)).err().map(|e| e.to_string());
    let by_name = refusal(EstimatorKind::PathSpace);
    assert!(by_name.is_some() && refusal(EstimatorKind::Auto) == by_name);
}

/// A box over a floor under a constant sky: what moves is flat and evenly lit, which suits `radiative`.
fn box_over_floor() -> Scene {
    let block = placed(procedural::cube(), Vec3::splat(0.5), 0.3, vec3(0.0, -0.3, 0.0));
    let scene = SceneBuilder::new()
        .shape("box", ShapeBuilder::new(block, diffuse(0.7, 0.5, 0.3)))
        .shape("floor", ShapeBuilder::new(floor(), diffuse(0.4, 0.5, 0.6)))
        .emitter("sky", sky());
    let mut scene = by_box_filter(seen(scene, [vec3(0.8, 1.2, 4.0), vec3(0.0, -0.5, 0.0)], 3));
    let sensor = &mut scene.sensors[0].item.sensor;
    *sensor = sensor.with_film([30, 24]).unwrap();
    scene
}

/// The gradient by the box's vertices of the sum of the image.
fn gradient_of_sum(session: &mut Session, spp: u32) -> Vec<Vec3> {
    let [w, h] = box_over_floor().sensors[0].item.sensor.film();
    let adjoint = vec![Rgb::ONE; (w * h) as usize];
    let found = session.gradient(&["box"], spp, &adjoint, &Unattended).unwrap();
    found.vertices(&box_over_floor(), 0).unwrap()
}

#[test]
fn gradients_take_what_motions_of_their_items_choose() {
    const SPP: u32 = 128;
    let scene = box_over_floor();
    let session = |kind| Session::new(&scene, &[], &settings(kind)).unwrap();
    let by = |kind| gradient_of_sum(&mut session(kind), SPP);
    let chosen = by(EstimatorKind::Auto);
    assert!(chosen == by(EstimatorKind::Radiative));
    assert!(chosen != by(EstimatorKind::PathSpace));
    // The choice stays as the scene changes, even for samples that are too few for a pilot, and is that of a loss in a fit.
    let mut known = session(EstimatorKind::Auto);
    gradient_of_sum(&mut known, SPP);
    known.update(&scene, &[]).unwrap();
    let few = |kind| gradient_of_sum(&mut session(kind), 4);
    assert!(gradient_of_sum(&mut known, 4) == few(EstimatorKind::Radiative));
    assert!(few(EstimatorKind::Auto) == few(EstimatorKind::PathSpace));
    assert!(few(EstimatorKind::PathSpace) != few(EstimatorKind::Radiative));
}

#[test]
fn fits_of_groups_choose_for_these() {
    let scene = box_over_floor();
    let size = scene.sensors[0].item.sensor.film();
    let dark = Reference::new(size, vec![Rgb::ZERO; (size[0] * size[1]) as usize]).unwrap();
    let gradient = |kind| {
        let group = Group::new("box", &scene, &"box", GroupKind::Vertices).unwrap();
        let views = vec![View::new(0, dark.clone())];
        let fit = Fit::new(scene.clone(), vec![], views, Loss::L2, settings(kind)).unwrap();
        let mut fit = fit.with_groups(vec![group]).unwrap();
        let seen = fit.evaluate(&[], 8, 1, &Unattended).unwrap().unwrap();
        seen.group_gradient(0).to_vec()
    };
    let chosen = gradient(EstimatorKind::Auto);
    assert!(chosen == gradient(EstimatorKind::Radiative));
    assert!(chosen != gradient(EstimatorKind::PathSpace));
}
