//! Derivatives by phase functions that vary in space, against finite differences, by all estimators.

use crate::common::differences::agree_with_differences;
use crate::common::*;
use drt_estimators::{EstimatorKind, Scene};
use drt_math::{Rgb, ValueChange, vec3};
use drt_medium::Homogeneous;
use drt_motion::{GeometryChange, Parameter};

/// Fog whose coefficients are the same everywhere takes the place of the smoke, so that nothing but the phase function moves with the grid.
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

fn judge(scene: &Scene, parameters: &[Parameter]) {
    let both = [EstimatorKind::PathSpace, EstimatorKind::Warped];
    agree_with_differences(scene, parameters, 0.1, 2000, &both, |_| {});
}

#[test]
fn estimators_agree_where_phase_functions_vary() {
    for (scene, property) in varied_smoke(1.0).into_iter().zip(["g", "weight"]) {
        let scene = in_the_sun(scene);
        judge(&scene, &by_value(property));
        judge(&in_fog(scene), &by_motion());
    }
}
