//! Derivatives by phase functions that vary in space, against finite differences, by all estimators.

use crate::common::*;
use drt_estimators::{
    EstimatorKind, PathSampling, Scene, Settings, Unattended, agreement, finite_differences,
};
use drt_math::{Rgb, ValueChange, vec3};
use drt_medium::Homogeneous;
use drt_motion::{GeometryChange, Parameter};

/// The same phase function where everything else is the same everywhere, so that nothing but it moves with the grid.
fn in_fog(mut scene: Scene) -> Scene {
    let fog = Homogeneous::new(Rgb::new(0.3, 0.4, 0.6), Rgb::splat(0.8), Rgb::ZERO);
    scene.media[0].item.kind = fog.expect("coefficients").into();
    scene
}

fn by_value(property: &str) -> Vec<Parameter> {
    let by = |amount: f64| ValueChange::Add(Rgb::splat(amount));
    // A slab of voxels, which a loop over single ones makes.
    let slab = (0..16).map(|i| [i % 4, i / 4, 2]);
    let slab = slab.map(|voxel| changes_voxel("smoke", property, voxel, by(0.8))).collect();
    vec![
        parameter("voxels", 0.0, slab),
        parameter("all", 0.0, vec![changes("smoke", property, by(0.3))]),
    ]
}

fn by_motion() -> Vec<Parameter> {
    let shift = GeometryChange::Translate(vec3(0.3, -0.2, 0.6));
    vec![parameter("shifts", 0.0, vec![moves("smoke", shift)])]
}

fn judge(what: &str, scene: &Scene, parameters: &[Parameter]) {
    let (step, spp) = (0.1, 2000);
    let settings = Settings { seed: 3, ..Settings::default() };
    let differences = finite_differences(scene, parameters, &settings, 4 * spp, step, &Unattended);
    let differences = differences.expect("a valid scene");
    let kinds = [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped];
    let from_camera = kinds.map(|kind| (kind, PathSampling::Unidirectional));
    let both = [EstimatorKind::PathSpace, EstimatorKind::Warped]
        .map(|kind| (kind, PathSampling::Bidirectional));
    for (seed, (estimator, sampling)) in (7..).zip(from_camera.into_iter().chain(both)) {
        let settings = Settings { estimator, sampling, seed, ..Settings::default() };
        let found = rendered(scene, parameters, &settings, spp);
        for (d, difference) in found.derivatives.iter().zip(&differences) {
            let name = format!("{what}, {} by {estimator:?}, {sampling:?}", d.name);
            let same = agreement(&d.total, difference, None);
            assert!(same.agrees, "{name}: {same:?}");
            let [known, error] = sum(difference);
            let [value, own] = sum(&d.total);
            let off = |part: f64| (part * value - known).abs() / f64::hypot(own, error);
            println!("{name}: {value} ± {own}, {known} ± {error}");
            assert!(off(1.0) < 4.0, "{name}: {}", off(1.0));
            // As if half of it were missing.
            assert!(off(0.5) > 4.0, "{name}: {}", off(0.5));
        }
    }
}

#[test]
fn estimators_agree_where_phase_functions_vary() {
    for (scene, property) in varied_smoke(1.0).into_iter().zip(["g", "weight"]) {
        let scene = in_the_sun(scene);
        judge(property, &scene, &by_value(property));
        judge(property, &in_fog(scene), &by_motion());
    }
}
