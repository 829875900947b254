//! Images and derivatives by a camera of parallel rays.

use crate::common::*;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor, look_at};
use drt_estimators::{
    EstimatorKind, PathSampling, Scene, Session, Settings, Unattended, agreement,
    finite_differences, gradient,
};
use drt_math::{Affine, Rgb, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

/// A scene seen along parallel rays; the film is `width` wide.
fn seen(mut scene: Scene, origin: Vec3, width: f64) -> Scene {
    let filter = Filter::new(FilterKind::TENT).expect("a valid filter");
    let view = look_at(origin, vec3(0.0, -0.1, 0.0), Vec3::Y).expect("a view");
    let linear = view.linear * (0.5 * width);
    let lens = Lens { near: 1e-3, ..Lens::default() };
    let sensor = Sensor::orthographic(&Affine { linear, ..view }, lens, FILM, filter);
    scene.sensors[0].item.sensor = sensor.expect("a valid camera");
    scene.integrator.max_depth = Some(3);
    scene
}

fn parameters() -> Vec<Parameter> {
    let turn = GeometryChange::Rotate { axis: vec3(0.3, 0.8, -0.2), pivot: vec3(0.2, 0.0, 0.1) };
    let grow = GeometryChange::Scale { factor: Vec3::splat(0.4), pivot: vec3(-0.7, 0.1, 0.4) };
    vec![
        parameter("ball", 0.0, vec![moves("ball", shift())]),
        parameter("turn", 0.0, vec![moves("camera", turn)]),
        parameter("grow", 0.0, vec![moves("camera", grow)]),
    ]
}

fn scenes() -> [Scene; 2] {
    let from = vec3(1.5, 2.5, 3.0);
    let surfaces = surfaces(phong(), diffuse(0.6, 0.5, 0.7));
    [seen(surfaces, from, 4.0), seen(fog(), from * 3.0, 5.0)]
}

/// By two estimators that are derived apart, and by finite differences; at a multiple of the samples.
fn derivatives_agree(times: u32) {
    for (scene, faulty) in scenes().iter().zip([true, false]) {
        let by = |estimator, seed| {
            let settings = Settings { estimator, seed, ..Settings::default() };
            rendered(scene, &parameters(), &settings, 2000 * times).derivatives
        };
        let path = by(EstimatorKind::PathSpace, 1);
        let radiative = by(EstimatorKind::Radiative, 2);
        let settings = Settings { seed: 3, ..Settings::default() };
        let differences =
            finite_differences(scene, &parameters(), &settings, 2000 * times, 3e-2, &Unattended);
        let differences = differences.expect("a valid scene");
        for ((a, b), c) in path.iter().zip(&radiative).zip(&differences) {
            for other in [&b.total, c] {
                let found = agreement(&a.total, other, None);
                assert!(found.agrees, "{} {found:?}", a.name);
            }
            // As if half of it were missing.
            if faulty {
                assert!(!agreement(&multiple(&a.total, 0.5), &b.total, None).agrees, "{}", a.name);
            }
        }
    }
}

#[test]
fn derivatives_agree_in_short() {
    derivatives_agree(1);
}

#[test]
#[ignore = "minutes"]
fn derivatives_agree_at_length() {
    derivatives_agree(32);
}

#[test]
fn images_from_both_ends_are_those_from_the_camera() {
    for scene in scenes() {
        let [one, both] =
            [PathSampling::Unidirectional, PathSampling::Bidirectional].map(|sampling| {
                let settings = Settings { sampling, seed: sampling as u64, ..Settings::default() };
                rendered(&scene, &[], &settings, 128).image
            });
        let found = agreement(&both, &one, None);
        assert!(found.agrees, "{found:?}");
    }
}

/// From ever farther away through an ever narrower field of view.
#[test]
fn a_far_pinhole_sees_the_same() {
    for mut scene in scenes() {
        let settings = Settings::default();
        let near = rendered(&scene, &[], &settings, 128).image;
        let old = &scene.sensors[0].item.sensor;
        let (p, film) = (*old.pinhole(), old.film());
        let distance = 1e4;
        let half = 0.5 * p.pixel_size * f64::from(film[0]);
        let lens = Lens { far: 1e9, ..Lens::with_fov(2.0 * (half / distance).atan().to_degrees()) };
        let eye = [p.position - p.forward * distance, p.position, p.up];
        let filter = old.filter().clone();
        let pinhole = Sensor::look_at(eye, lens, film, filter).expect("a valid camera");
        scene.sensors[0].item.sensor = pinhole;
        let settings = Settings { seed: 1, ..settings };
        let far = rendered(&scene, &[], &settings, 128).image;
        let found = agreement(&near, &far, None);
        assert!(found.agrees, "{found:?}");
    }
}

#[test]
fn what_is_not_derived_is_refused() {
    let refusal = |scene: &Scene, estimator: EstimatorKind| {
        let settings = Settings { estimator, ..Settings::default() };
        let session = Session::new(scene, &parameters(), &settings);
        let adjoint = vec![Rgb::ONE; (FILM[0] * FILM[1]) as usize];
        let reverse = gradient(scene, &["camera"], &settings, 1, &adjoint, &Unattended);
        let message = session.err().map(|e| e.to_string());
        assert_eq!(message, reverse.err().map(|e| e.to_string()));
        message.unwrap_or_default()
    };
    let [scene, fog] = scenes();
    let message = refusal(&scene, EstimatorKind::Warped);
    assert!(
        ["camera", "orthographic", "`warped`"].iter().all(|w| message.contains(w)),
        "{message}"
    );
    let moved = |mut scene: Scene, to: Vec3| {
        let sensor = &mut scene.sensors[0].item.sensor;
        *sensor = sensor.moved(&Affine::translation(to)).expect("a valid camera");
        scene
    };
    let forward = fog.sensors[0].item.sensor.pinhole().forward;
    let inside = moved(fog, forward * 9.0);
    let message = refusal(&inside, EstimatorKind::PathSpace);
    assert!(["camera", "medium", "`path-space`"].iter().all(|w| message.contains(w)), "{message}");
    let message = refusal(&moved(scene, forward * 4.2), EstimatorKind::Radiative);
    assert!(message.contains("camera") && message.contains("`ball` goes through"), "{message}");
}
