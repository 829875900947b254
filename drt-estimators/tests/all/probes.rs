//! Derivatives by the extinction of media with empty voxels, where free flight puts no vertices.

use crate::common::differences::agree_with_differences;
use crate::common::pairing::{pair, targets};
use crate::common::*;
use drt_estimators::{
    EstimatorKind, InteriorMotion, Scene, Session, Settings, Target, Unattended, gradient,
};
use drt_math::{Affine, Rgb, Rng, ValueChange};
use drt_medium::Property;
use drt_motion::Parameter;

fn parameters(value: f64) -> Vec<Parameter> {
    let voxel = changes_voxel("cloud", "sigma_t", [2, 2, 3], ValueChange::Add(Rgb::splat(3.0)));
    let drifts = vec![moves("cloud", shift()), moves("box", shift()), thickens()];
    vec![
        parameter("all", value, vec![thickens()]),
        parameter("voxel", value, vec![voxel]),
        parameter("drifts", value, drifts),
    ]
}

fn colours(value: f64) -> Vec<Parameter> {
    vec![parameter("albedo", value, vec![changes("cloud", "albedo", grey(-0.5))])]
}

/// Nothing is scattered yet: the derivative is ∫ (albedo S - L) dy with both radiances that of the sky.
#[test]
fn the_first_of_a_medium() {
    let by = |albedo: Rgb| {
        let settings = Settings { seed: 4, ..Settings::default() };
        let found = rendered(&empty_cloud(albedo), &parameters(0.0)[..1], &settings, 16);
        found.derivatives[0].total.pixels.clone()
    };
    let albedo = Rgb::new(0.9, 0.7, 0.0);
    let off = |wrong: f64| {
        let both = by(albedo).into_iter().zip(by(Rgb::ZERO));
        let off = both.map(|(found, absorbed)| {
            let expected = absorbed.mean * (Rgb::ONE - albedo * wrong);
            (found.mean - expected).max_abs() / absorbed.mean.max_abs()
        });
        off.fold(0.0, f64::max)
    };
    assert!(off(1.0) < 1e-12, "{:e}", off(1.0));
    assert!(off(1.001) > 1e-4);
}

/// All estimators and samplings agree with finite differences.
#[test]
fn estimators_agree_in_sparse_media() {
    judge(&sparse_cloud(), &parameters(STEP));
}

/// Where extinctions stay as they are, probes are elsewhere.
#[test]
fn estimators_agree_on_colours_alone() {
    judge(&sparse_cloud(), &colours(STEP));
}

/// Light that a medium emits, and that of a lamp in it, is gathered at probes as any other is.
#[test]
fn estimators_agree_in_sparse_media_that_shine() {
    let emits = |voxel| {
        let op = ValueChange::Add(Rgb::new(0.9, 0.7, 0.5));
        changes_voxel("cloud", "emission", voxel, op)
    };
    let slab = (0..16).map(|i| emits([i % 4, i / 4, 2])).collect();
    let mut of_glow = parameters(STEP);
    of_glow.retain(|p| p.name != "voxel");
    of_glow.push(parameter("emission", STEP, slab));
    judge(&glowing_cloud(), &of_glow);
    judge(&inhabited_cloud(), &parameters(STEP)[..1]);
}

/// As near to the exact zeros as a central difference goes.
const STEP: f64 = 0.05;

fn judge(scene: &Scene, parameters: &[Parameter]) {
    agree_with_differences(scene, parameters, STEP, 4000, &[EstimatorKind::PathSpace], |found| {
        assert!(found.counters.probes > 0);
    });
}

/// Coefficients alone take the same paths as the medium with its motion, and leave the motion out.
#[test]
fn gradients_of_media_at_rest() {
    let scene = sparse_cloud();
    let settings = Settings { estimator: EstimatorKind::PathSpace, ..Settings::default() };
    let [width, height] = scene.sensors[0].item.sensor.film();
    let adjoint = vec![Rgb::ONE; (width * height) as usize];
    let by = |target: Target| {
        let found = gradient(&scene, &[target], &settings, 4, &adjoint, &Unattended);
        found.expect("a valid scene").media.swap_remove(0).expect("wanted")
    };
    let [moved, at_rest] = [Target::Medium(0), Target::Coefficients(0)].map(by);
    let [all, alone] = [&moved, &at_rest].map(|g| {
        let voxels = g.field(Property::SigmaT).voxels.as_ref().expect("a grid");
        voxels.values().into_owned()
    });
    let largest = all.iter().fold(0.0, |m, v| f64::max(m, v.abs()));
    assert!(largest > 0.0 && all.iter().zip(&alone).all(|(a, b)| (a - b).abs() < 1e-12 * largest));
    assert!(moved.velocity != Affine::ZERO && at_rest.velocity == Affine::ZERO);
}

/// The reverse mode is the transpose of the forward mode.
#[test]
fn transposes_of_probes() {
    let glows = ValueChange::Add(Rgb::new(0.9, 0.7, 0.5));
    let glow = vec![changes_voxel("cloud", "emission", [1, 2, 2], glows), thickens()];
    let glow = parameter("glow", 0.0, glow);
    for (scene, parameters) in [
        (sparse_cloud(), parameters(0.0)),
        (glowing_cloud(), vec![parameters(0.0).swap_remove(2), glow]),
    ] {
        transposed(&scene, &parameters);
    }
}

fn transposed(scene: &Scene, parameters: &[Parameter]) {
    let [width, height] = scene.sensors[0].item.sensor.film();
    let mut rng = Rng::new(99, 0, 0);
    let mut signed = || 2.0 * rng.next_f64() - 1.0;
    let adjoint: Vec<Rgb> =
        (0..width * height).map(|_| Rgb::new(signed(), signed(), signed())).collect();
    for estimator in [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped] {
        for p in parameters {
            let insides = vec![(0, InteriorMotion::Static)];
            let settings =
                Settings { estimator, insides, seed: 3, guiding: false, ..Settings::default() };
            let mut session =
                Session::new(scene, core::slice::from_ref(p), &settings).expect("a valid scene");
            assert!(session.run(16, &Unattended));
            let forward = session.rendering();
            assert!(forward.counters.probes > 0);
            let pixels = forward.derivatives[0].total.pixels.iter().zip(&adjoint);
            let products: Vec<Rgb> = pixels.map(|(pixel, a)| pixel.mean * *a).collect();
            let size: f64 = products.iter().map(|p| p.abs().sum()).sum();
            let along: f64 = products.iter().map(|p| p.sum()).sum();
            let gradient = session.gradient(&targets(scene, p), 16, &adjoint, &Unattended);
            let back = pair(scene, p, &gradient.expect("a valid scene"));
            assert!((along - back).abs() < 1e-9 * size, "{}: {along} {back}", p.name);
        }
    }
}

/// Where no voxel is empty, no probes are taken.
#[test]
fn probes_only_where_they_help() {
    let settings = Settings::default();
    let full = full_cloud();
    let colours = colours(0.0).swap_remove(0);
    for (scene, p, probed) in [
        (&sparse_cloud(), parameters(0.0).swap_remove(0), true),
        (&sparse_cloud(), colours.clone(), true),
        (&full, colours, false),
        (&full, parameters(0.0).swap_remove(0), false),
    ] {
        let found = rendered(scene, core::slice::from_ref(&p), &settings, 4);
        assert_eq!(found.counters.probes > 0, probed);
        let said = found.plan.media[0].tracking.contains("probes");
        assert_eq!(said, probed, "{}", found.plan.media[0].tracking);
    }
}
