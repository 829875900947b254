//! Derivatives of media of microflakes against finite differences, by all estimators: by their matrix, as they turn and move, and as all
//! around them moves, so that they are seen from elsewhere.

use crate::common::differences::agree_with_differences;
use crate::common::*;
use drt_estimators::{EstimatorKind, Scene, Session, Settings};
use drt_math::{Rgb, ValueChange, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

fn add(r: f64, g: f64, b: f64) -> ValueChange {
    ValueChange::Add(Rgb::new(r, g, b))
}

fn judge(scene: &Scene, parameters: &[Parameter], step: f64, spp: u32) {
    let both = [EstimatorKind::PathSpace, EstimatorKind::Warped];
    agree_with_differences(scene, parameters, step, spp, &both, |_| {});
}

/// The off-diagonal entries everywhere, which turn the flakes.
fn askew() -> Parameter {
    let change = changes("smoke", "sggx_off_diagonal", add(0.3, -0.5, 0.6));
    parameter("off the diagonal", 0.0, vec![change])
}

/// The diagonal entries everywhere.
fn larger() -> Parameter {
    let change = changes("smoke", "sggx_diagonal", add(1.0, 0.3, 0.6));
    parameter("on the diagonal", 0.0, vec![change])
}

fn turns() -> Parameter {
    parameter("turns", 0.0, vec![moves("smoke", turn())])
}

/// Flakes are alike in all of a fog.
#[test]
fn in_fog() {
    judge(&in_the_sun(flaky_fog()), &[askew(), turns()], 0.03, 200);
}

/// The matrix in some voxels and in all, and the voxels as they move and turn.
#[test]
#[ignore = "half a minute"]
fn in_voxels() {
    let slab = (0..16).map(|i| [i % 4, i / 4, 2]);
    let by = add(1.0, 2.0, -0.4);
    let slab = slab.map(|voxel| changes_voxel("smoke", "sggx_diagonal", voxel, by)).collect();
    let all = [larger(), askew(), parameter("slab", 0.0, slab)];
    judge(&in_the_sun(flaky_smoke(1.0)), &all, 0.03, 2000);
    judge(&in_the_sun(flaky_smoke(0.0)), &[turns()], 0.03, 3000);
    judge(&in_the_sun(flaky_fog()), &[larger()], 0.02, 2000);
}

/// They stay, and what they are seen from, lit by and bounded by moves.
#[test]
#[ignore = "half a minute"]
fn seen_from_elsewhere() {
    let nearer = |target: &str, by: Vec3| {
        parameter(target, 0.0, vec![moves(target, GeometryChange::Translate(by))])
    };
    let grows = GeometryChange::Scale { factor: vec3(0.6, 0.9, 0.3), pivot: vec3(0.1, 0.0, 0.0) };
    let around =
        vec![nearer("camera", vec3(0.0, 1.0, -2.0)), nearer("bulb", vec3(0.9, -1.0, -0.6))];
    let of = |scene: Scene| alone(scene.media[0].item.clone());
    judge(&of(flaky_smoke(0.0)), &around, 0.02, 4000);
    // Fog ends where the box does.
    let grows = parameter("grows", 0.0, vec![moves("box", grows)]);
    judge(&of(flaky_fog()), &[around, vec![grows]].concat(), 0.02, 3000);
}

/// What SGGX does not tell is refused.
#[test]
fn stretches_are_refused() {
    let scene = flaky_smoke(0.0);
    let stretches = [parameter("stretch", 0.0, vec![moves("smoke", stretch())])];
    let refused = Session::new(&scene, &stretches, &Settings::default()).err().expect("refused");
    let text = refused.to_string();
    assert!(text.contains("stretch") && text.contains("SGGX"), "{text}");
}
