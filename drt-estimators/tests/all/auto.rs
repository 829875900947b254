//! The estimator that a pilot chooses: it is one of those that have names, bit for bit, with little work in the pilot.

use crate::common::*;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::{
    EstimatorKind, PathSampling, Rendering, Scene, Session, Settings, Unattended, gradient,
};
use drt_math::{Rgb, Vec3};
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

/// A ball over a floor under a lamp and a sky, by a box filter: pixels' borders are edges to `path-space`.
fn room() -> Scene {
    let mut scene = surfaces_in_extended_light(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6));
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
    let (name, works) = why.split_once(": in a pilot").unwrap();
    // `path-space` stays where little more than noise tells it from another one, and no other is chosen without the least work.
    let work_of = |name: &str| -> f64 {
        let (_, after) = works.split_once(&format!("{name} ")).unwrap();
        after.split(',').next().unwrap().parse().unwrap()
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
    // What all refuse is refused as `path-space` does.
    let mut mirror = room();
    mirror.bsdfs[0].item = drt_estimators::surface::Bsdf::Conductor(Default::default());
    let refusal =
        |kind| Session::new(&mirror, &camera_moves(), &settings(kind)).err().map(|e| e.to_string());
    let by_name = refusal(EstimatorKind::PathSpace);
    assert!(by_name.is_some() && refusal(EstimatorKind::Auto) == by_name);
}

#[test]
fn gradients_take_path_space() {
    let scene = room();
    let [w, h] = scene.sensors[0].item.sensor.film();
    let adjoint = vec![Rgb::ONE; (w * h) as usize];
    let by = |kind| {
        let found = gradient(&scene, &["ball"], &settings(kind), 4, &adjoint, &Unattended).unwrap();
        format!("{:?}", found.shapes)
    };
    assert!(by(EstimatorKind::Auto) == by(EstimatorKind::PathSpace));
}
