//! Same seed, same bits: whatever the number of threads, and every time.

use crate::common::pairing::targets;
use crate::common::*;
use drt_estimators::{
    Layer, Rendering, Scene, SceneGradient, Session, Settings, Unattended, gradient,
};
use drt_math::{Rgb, vec3};
use drt_motion::{GeometryChange, Parameter};

const SPP: u32 = 20;

fn settings(threads: usize, seed: u64) -> Settings {
    Settings { seed, threads, terms: true, ..Settings::default() }
}

/// Scenes with a bit of everything, each with parameters that move and change it.
fn cases() -> Vec<(Scene, Vec<Parameter>)> {
    let (a, b, c) = (surfaces(metal(), phong()), fog(), smoke(1.0));
    let on_surfaces = vec![
        parameter("ball", 0.0, vec![moves("ball", turn())]),
        parameter(
            "lamp",
            0.1,
            vec![moves("lamp", shift()), changes("lamp", "radiance", grey(1.0))],
        ),
    ];
    let in_fog = vec![
        parameter("ball", 0.0, vec![moves("ball", wobble(&b, "ball", 1))]),
        parameter("blob", 0.0, vec![moves("blob", shift()), changes("thin", "albedo", grey(0.3))]),
    ];
    let in_smoke = vec![
        parameter("voxel", 0.0, vec![changes_voxel("smoke", "sigma_t", [1, 2, 3], grey(0.3))]),
        parameter("camera", 0.0, vec![moves("camera", turn())]),
    ];
    vec![(a, on_surfaces), (b, in_fog), (c, in_smoke)]
}

fn rendered(scene: &Scene, parameters: &[Parameter], settings: &Settings) -> Rendering {
    let mut session = Session::new(scene, parameters, settings).expect("a valid scene");
    assert!(session.run(SPP, &Unattended));
    session.rendering()
}

/// Everything that was computed, in order.
fn layers(r: &Rendering) -> Vec<&Layer> {
    let of = |d| -> Vec<&Layer> {
        let d: &drt_estimators::Derivative = d;
        core::iter::once(&d.total).chain(d.terms.iter().map(|(_, l)| l)).collect()
    };
    core::iter::once(&r.image).chain(r.derivatives.iter().flat_map(of)).collect()
}

fn same(a: &Rendering, b: &Rendering) -> bool {
    let (x, y) = (layers(a), layers(b));
    let equal = |(x, y): (&&Layer, &&Layer)| {
        x.pixels == y.pixels && x.blocks == y.blocks && x.total == y.total
    };
    assert_eq!(x.len(), y.len());
    x.iter().zip(&y).all(equal)
}

fn gradients(scene: &Scene, parameters: &[Parameter], settings: &Settings) -> SceneGradient {
    let mut wanted: Vec<_> = parameters.iter().flat_map(|p| targets(scene, p)).collect();
    wanted.dedup();
    let pixels = FILM[0] * FILM[1];
    let adjoint: Vec<Rgb> = (0..pixels).map(|i| Rgb::splat(f64::from(i % 7) - 3.0)).collect();
    gradient(scene, &wanted, settings, SPP, &adjoint, &Unattended).expect("a valid scene")
}

fn same_gradient(a: &SceneGradient, b: &SceneGradient) -> bool {
    a.shapes == b.shapes
        && a.media == b.media
        && a.bsdfs == b.bsdfs
        && a.emitters == b.emitters
        && a.sensor == b.sensor
}

#[test]
fn the_number_of_threads_does_not_matter() {
    for (scene, parameters) in cases() {
        let one = rendered(&scene, &parameters, &settings(1, 5));
        let gradient_of_one = gradients(&scene, &parameters, &settings(1, 5));
        for threads in [2, 5] {
            let many = rendered(&scene, &parameters, &settings(threads, 5));
            assert!(same(&one, &many), "{threads} threads");
            assert_eq!(one.counters, many.counters);
            let gradient = gradients(&scene, &parameters, &settings(threads, 5));
            assert!(same_gradient(&gradient_of_one, &gradient), "{threads} threads");
            assert_eq!(gradient_of_one.counters, gradient.counters);
        }
    }
}

#[test]
fn the_seed_decides_everything() {
    for (scene, parameters) in cases() {
        let run = |seed| rendered(&scene, &parameters, &settings(1, seed));
        let (first, again, other) = (run(1), run(1), run(2));
        assert!(same(&first, &again));
        for (a, b) in layers(&first).into_iter().zip(layers(&other)) {
            let black = a.total.mean.is_zero() && b.total.mean.is_zero();
            assert!(black || a.total.mean != b.total.mean);
        }
        let run = |seed| gradients(&scene, &parameters, &settings(1, seed));
        let (first, again, other) = (run(1), run(1), run(2));
        assert!(same_gradient(&first, &again) && !same_gradient(&first, &other));
    }
}

/// A derivative does not change when others are asked for along with it, as long as they need
/// nothing else to be sampled.
#[test]
fn parameters_do_not_disturb_each_other() {
    let scene = surfaces(phong(), phong());
    // Of the same shape, so that the same edges count for both.
    let slide = parameter("slide", 0.0, vec![moves("ball", shift())]);
    let up = GeometryChange::Translate(vec3(0.1, 0.2, 0.3));
    let lift = parameter("lift", 0.0, vec![moves("ball", up)]);
    let alone = rendered(&scene, core::slice::from_ref(&lift), &settings(1, 5));
    let both = rendered(&scene, &[slide, lift], &settings(1, 5));
    assert_eq!(alone.image.pixels, both.image.pixels);
    let (a, b) = (&alone.derivatives[0].total.pixels, &both.derivatives[1].total.pixels);
    for (a, b) in a.iter().zip(b) {
        assert!((a.mean - b.mean).max_abs() <= 1e-12 * a.stderr.max_abs());
    }
}

/// More samples in several calls are as good as all at once.
#[test]
fn interior_samples_continue_where_they_stopped() {
    let scene = fog();
    let parameters = [parameter("fog", 0.0, vec![changes("thin", "sigma_t", grey(1.0))])];
    let at_once = rendered(&scene, &parameters, &settings(1, 5));
    let mut session = Session::new(&scene, &parameters, &settings(1, 5)).expect("a valid scene");
    assert!([6, 2, 12].into_iter().all(|spp| session.run(spp, &Unattended)));
    let in_parts = session.rendering();
    assert_eq!((at_once.spp, in_parts.spp), (SPP, SPP));
    for (a, b) in layers(&at_once).into_iter().zip(layers(&in_parts)) {
        let (a, b) = (&a.total, &b.total);
        let error = (a.stderr * a.stderr + b.stderr * b.stderr).map(f64::sqrt);
        assert!((a.mean - b.mean).max_abs() < 4.0 * error.max_abs());
        // Neither is much more certain than the other, nor are they the same samples.
        assert!((a.stderr.g / b.stderr.g).ln().abs() < 0.5 && a.mean != b.mean);
    }
}
