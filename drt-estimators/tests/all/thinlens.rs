//! Images and derivatives by a camera with a lens, parts of films, and emitters that the camera does not see.

use std::sync::Arc;

use crate::common::*;
use drt_estimators::EstimatorKind::{PathSpace, Radiative, Warped};
use drt_estimators::PathSampling::{Bidirectional, Unidirectional};
use drt_estimators::sensor::{Aperture, Sensor};
use drt_estimators::{
    AuxiliarySamples, Estimate, Scene, Session, Settings, Unattended, Warp, agreement,
    finite_differences, gradient,
};
use drt_geom::procedural;
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

/// A scene seen through a lens that is sharp on the ball.
fn through_a_lens(mut scene: Scene) -> Scene {
    let sensor = &mut scene.sensors[0].item.sensor;
    let aperture = Aperture { radius: 0.4, focus_distance: 2.0 };
    *sensor = sensor.clone().with_aperture(aperture).expect("a lens");
    scene.integrator.max_depth = Some(3);
    scene
}

fn scenes() -> [Scene; 2] {
    [surfaces(phong(), diffuse(0.6, 0.5, 0.7)), fog()].map(through_a_lens)
}

fn parameters() -> Vec<Parameter> {
    let turn = GeometryChange::Rotate { axis: vec3(0.3, 0.8, -0.2), pivot: vec3(0.2, 0.0, 2.1) };
    vec![
        parameter("ball", 0.0, vec![moves("ball", shift())]),
        parameter("turn", 0.0, vec![moves("camera", turn)]),
        parameter("wide", 0.0, vec![changes("camera", "aperture_radius", grey(0.3))]),
        parameter("focus", 0.0, vec![changes("camera", "focus_distance", grey(1.5))]),
        parameter("zoom", 0.0, vec![changes("camera", "fov", grey(8.0))]),
    ]
}

fn derivatives_agree(times: u32) {
    for (scene, faulty) in scenes().iter().zip([true, false]) {
        let settings = Settings { seed: 3, ..Settings::default() };
        let differences =
            finite_differences(scene, &parameters(), &settings, 4000 * times, 2e-2, &Unattended);
        let differences = differences.expect("a valid scene");
        let from_camera = [PathSpace, Radiative, Warped].map(|e| (e, Unidirectional));
        let from_both = [PathSpace, Warped].map(|e| (e, Bidirectional));
        for (estimator, sampling) in from_camera.into_iter().chain(from_both) {
            let settings = Settings { seed: 1, estimator, sampling, ..Settings::default() };
            let own = rendered(scene, &parameters(), &settings, 4000 * times).derivatives;
            for (a, b) in own.iter().zip(&differences) {
                let found = agreement(&a.total, b, None);
                assert!(found.agrees, "{estimator:?} {sampling:?} {} {found:?}", a.name);
                // What the lens itself does is small beside the noise of a short run.
                if faulty && (times > 1 || ["ball", "turn"].contains(&&*a.name)) {
                    let half = agreement(&multiple(&a.total, 0.5), b, None);
                    assert!(!half.agrees, "{estimator:?} {sampling:?} {}", a.name);
                }
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

/// How far two estimates are apart, in standard errors.
fn apart(a: &Estimate, b: &Estimate) -> f64 {
    let z = |k: usize| {
        let [x, y, ex, ey] = [a.mean, b.mean, a.stderr, b.stderr].map(|v| v.to_array()[k]);
        (x - y).abs() / ex.hypot(ey).max(1e-12)
    };
    (0..3).map(z).fold(0.0, f64::max)
}

/// The mean of pinholes over the lens, and not the pinhole in its middle.
#[test]
fn a_lens_is_its_points() {
    let [scene, _] = scenes();
    let render = |scene: &Scene, spp: u32, seed: u64| {
        rendered(scene, &[], &Settings { seed, ..Settings::default() }, spp).image
    };
    let lens = render(&scene, 512, 1);
    let pinhole = |at: [f64; 2], seed: u64| {
        let mut scene = scene.clone();
        let sensor: &mut Sensor = &mut scene.sensors[0].item.sensor;
        *sensor = sensor.at_lens(at).into_owned();
        render(&scene, 32, seed)
    };
    // Points of a spiral, in rings of equal area.
    let n = 96_u32;
    let points = (0..n).map(|i| {
        let r = ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
        let angle = core::f64::consts::TAU * 0.618_034 * f64::from(i);
        pinhole([r * angle.cos(), r * angle.sin()], u64::from(2 + i))
    });
    let mut mean = vec![Estimate::default(); lens.pixels.len()];
    for image in points {
        for (sum, p) in mean.iter_mut().zip(&image.pixels) {
            sum.mean += p.mean * (1.0 / f64::from(n));
            let [a, b] = [sum.stderr, p.stderr * (1.0 / f64::from(n))].map(|e| e.to_array());
            sum.stderr = Rgb::from([0, 1, 2].map(|k| a[k].hypot(b[k])));
        }
    }
    let worst = |other: &[Estimate]| {
        lens.pixels.iter().zip(other).map(|(a, b)| apart(a, b)).fold(0.0, f64::max)
    };
    let found = worst(&mean);
    assert!(found < 4.5, "{found}");
    let middle = worst(&pinhole([0.0; 2], 1).pixels);
    assert!(middle > 6.0, "{middle}");
}

#[test]
fn a_part_of_a_film_is_that_of_the_whole() {
    let [whole, _] = scenes();
    let mut part = whole.clone();
    let sensor = &mut part.sensors[0].item.sensor;
    *sensor = sensor.cropped([2, 1], [3, 4]).expect("a part");
    let [whole, part] = [(whole, 1), (part, 2)].map(|(scene, seed)| {
        let settings = Settings { seed, ..Settings::default() };
        let r = rendered(&scene, &parameters()[..2], &settings, 400);
        [r.image, r.derivatives[0].total.clone(), r.derivatives[1].total.clone()]
    });
    for (a, b) in whole.iter().zip(&part) {
        assert_eq!(b.size, [3, 4]);
        for (x, y) in (0..4).flat_map(|y| (0..3).map(move |x| (x, y))) {
            let other = &a.pixels[(y + 1) * FILM[0] as usize + x + 2];
            let z = apart(other, &b.pixels[y * 3 + x]);
            assert!(z < 5.0, "{x} {y}: {z}");
        }
    }
}

#[test]
fn what_is_not_derived_is_refused() {
    let refusal = |scene: &Scene, settings: &Settings| {
        let session = Session::new(scene, &parameters()[..2], settings);
        let adjoint = vec![Rgb::ONE; (FILM[0] * FILM[1]) as usize];
        let reverse = gradient(scene, &["camera"], settings, 1, &adjoint, &Unattended);
        let messages = [session.err(), reverse.err()].map(|e| e.expect("a refusal").to_string());
        messages.join("; ")
    };
    let all = |message: &str, parts: &[&str]| {
        assert!(parts.iter().all(|p| message.contains(p)), "{message}");
    };
    let [scene, _] = scenes();
    for warp in [Warp::Points, Warp::Directions] {
        let warp = warp(AuxiliarySamples::default());
        let settings = Settings { estimator: Warped, warp, ..Settings::default() };
        all(&refusal(&scene, &settings), &["warp", "auxiliary points", "aperture"]);
    }
    let both = Settings { sampling: Bidirectional, ..Settings::default() };
    let mut hidden = surfaces(phong(), phong());
    hidden.integrator.hide_emitters = true;
    all(&refusal(&hidden, &both), &["sampling", "hidden emitters"]);
    for warp in [Warp::Points, Warp::Directions] {
        let warp = warp(AuxiliarySamples::default());
        let settings = Settings { estimator: Warped, warp, ..Settings::default() };
        all(&refusal(&hidden, &settings), &["bulb", "hide_emitters"]);
    }
}

/// The camera sees through lamps and no sky, but both shine on what it sees.
#[test]
fn hidden_emitters_have_derivatives() {
    let scenes = [surfaces(phong(), diffuse(0.6, 0.5, 0.7)), in_front_of_fog(fog_by_area_lights())];
    let turn = GeometryChange::Rotate { axis: vec3(0.3, 0.8, -0.2), pivot: vec3(0.2, 0.0, 2.1) };
    let parameters = [
        parameter("ball", 0.0, vec![moves("ball", shift())]),
        parameter("turn", 0.0, vec![moves("camera", turn)]),
        parameter("lamp", 0.0, vec![moves("lamp", shift())]),
        parameter("sky", 0.0, vec![changes("sky", "radiance", grey(0.3))]),
    ];
    for mut scene in scenes {
        scene.integrator.max_depth = Some(3);
        let settings = Settings { seed: 3, ..Settings::default() };
        let derivatives = |scene: &Scene| rendered(scene, &parameters, &settings, 2000).derivatives;
        let shown = derivatives(&scene);
        scene.integrator.hide_emitters = true;
        let own = derivatives(&scene);
        let differences =
            finite_differences(&scene, &parameters, &settings, 2000, 2e-2, &Unattended);
        for ((a, b), shown) in own.iter().zip(&differences.expect("a valid scene")).zip(&shown) {
            let found = agreement(&a.total, b, None);
            assert!(found.agrees, "{} {found:?}", a.name);
            // The lamp is small, and lights much more than it covers.
            let fault =
                if a.name == "lamp" { multiple(&a.total, -1.0) } else { shown.total.clone() };
            let fault = agreement(&fault, b, None);
            assert!(!fault.agrees, "{} {fault:?}", a.name);
        }
    }
}

/// Light of points in fog is left to another estimator, which does not know what is hidden.
#[test]
fn hidden_emitters_and_points_in_fog() {
    let mut scene = fog();
    scene.integrator.hide_emitters = true;
    let parameters = [parameter("ball", 0.0, vec![moves("ball", shift())])];
    let refused = Session::new(&scene, &parameters, &Settings::default()).err();
    let message = refused.expect("a refusal").to_string();
    assert!(message.contains("hide_emitters") && message.contains("`ball`"), "{message}");
}

#[test]
fn hidden_emitters_still_shine() {
    let mut scene = surfaces(phong(), diffuse(0.6, 0.5, 0.7));
    scene.shapes.retain(|s| s.id.as_deref() != Some("floor"));
    let render = |scene: &Scene, seed: u64| {
        rendered(scene, &[], &Settings { seed, ..Settings::default() }, 64).image.pixels
    };
    let shown = render(&scene, 1);
    // A lamp before everything, that shines away from it, is looked through.
    let lamp = scene.shapes.iter_mut().find(|s| s.emitter.is_some()).expect("a lamp");
    let old = std::mem::replace(
        &mut lamp.mesh,
        Arc::new(placed(procedural::rectangle(), Vec3::splat(3.0), 0.0, vec3(0.3, 0.9, 3.5))),
    );
    let i = scene.shapes.iter().position(|s| s.emitter.is_some()).expect("a lamp");
    assert!(render(&scene, 1).iter().all(|p| p.mean.r > 2.9));
    scene.integrator.hide_emitters = true;
    assert!(render(&scene, 1).iter().all(|p| p.mean.r < 2.9));
    scene.shapes[i].mesh = old;
    let hidden = render(&scene, 2);
    // In the corner is nothing but the sky, in the middle the ball.
    let (sky, ball) = (0, 2 * FILM[0] as usize + 2);
    assert!(shown[sky].mean.r > 0.15 && hidden[sky].mean == Rgb::ZERO, "{:?}", hidden[sky]);
    assert!(shown[ball].mean.r > 0.05 && apart(&shown[ball], &hidden[ball]) < 4.5);
}
