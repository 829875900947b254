//! Surfaces that pass through each other: the line where they meet is an edge that no mesh has.

use crate::common::*;
use drt_estimators::EstimatorKind::{PathSpace, Radiative, Warped};
use drt_estimators::emitter::Emitter;
use drt_estimators::{Scene, Settings, Unattended, agreement, finite_differences};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

/// A floor whose rims but one are out of view, which is at `end`, and what goes through it; both glow.
fn glowing(end: f64, body: Mesh) -> Scene {
    let glows = |mesh, radiance| {
        let radiance = Rgb::new(radiance, 1.0, 0.7 * radiance);
        ShapeBuilder::new(mesh, diffuse(0.0, 0.0, 0.0)).emitter(Emitter::Area { radiance })
    };
    let floor = procedural::grid(2, 2).transform(&turned(Vec3::X, vec3(0.0, 0.0, end - 9.0)));
    let scene =
        SceneBuilder::new().shape("floor", glows(floor, 0.5)).shape("body", glows(body, 2.0));
    seen(scene, [vec3(1.5, 1.4, 3.0), Vec3::ZERO], 1)
}

/// Nine times as large, by a quarter of a turn.
fn turned(axis: Vec3, translation: Vec3) -> Affine {
    Affine { linear: Mat3::rotation(axis, -core::f64::consts::FRAC_PI_2) * 9.0, translation }
}

fn shifted(x: f64, y: f64, z: f64) -> GeometryChange {
    GeometryChange::Translate(vec3(x, y, z))
}

/// Derivatives by all estimators beside finite differences.
fn check(scene: &Scene, parameters: &[Parameter]) {
    let settings = Settings::default();
    let differences = finite_differences(scene, parameters, &settings, 24_576, 0.01, &Unattended);
    let differences = differences.expect("a valid scene");
    for estimator in [PathSpace, Radiative, Warped] {
        let settings = Settings { estimator, ..Settings::default() };
        let rendering = rendered(scene, parameters, &settings, 12_288);
        for (d, expected) in rendering.derivatives.iter().zip(&differences) {
            let found = agreement(&d.total, expected, None);
            assert!(found.agrees, "{estimator:?} {} {found:?}", d.name);
            let ([own, error], [other, other_error]) = (sum(&d.total), sum(expected));
            let error = error.hypot(other_error);
            println!("{estimator:?} {} {own} {other} +- {error}", d.name);
            assert!((own - other).abs() < 4.0 * error, "{own} {other} +- {error}");
            assert!(error < 0.04 * other.abs(), "{own} {other} +- {error}");
            // Planted: two fifths are missing.
            let faulty = agreement(&multiple(&d.total, 0.6), expected, None);
            assert!(!faulty.agrees, "{estimator:?} {} {faulty:?}", d.name);
        }
    }
}

/// What is seen beside the line of a floor and a wall changes with it alone. Of the floor's edges one is there, unless the
/// wall is beside it.
#[test]
fn the_line_moves_with_both() {
    let tilt = GeometryChange::Rotate { axis: vec3(0.3, 0.2, 1.0), pivot: vec3(0.5, 0.0, 0.0) };
    let both = vec![moves("body", shifted(0.5, 0.3, 0.0)), moves("floor", shifted(0.2, 0.8, 0.1))];
    let parameters = [
        parameter("wall", 0.0, vec![moves("body", shifted(1.0, 0.4, 0.3))]),
        parameter("floor", 0.0, vec![moves("floor", tilt)]),
        parameter("both", 0.0, both),
    ];
    for beside in [0.0, 0.07] {
        let wall = procedural::grid(3, 4).transform(&turned(Vec3::Y, vec3(beside, 0.0, 0.0)));
        check(&glowing(9.0, wall), &parameters);
    }
}

/// A beam that lies on the floor by its edges: where the floor ends they are edges like others.
#[test]
fn edges_of_a_mesh_may_be_the_line() {
    let eighth = Mat3::rotation(Vec3::Z, 0.5 * core::f64::consts::FRAC_PI_2);
    let linear = eighth * Mat3::diagonal(vec3(0.4, 0.4, 9.0));
    let beam = procedural::cube().transform(&Affine { linear, translation: Vec3::ZERO });
    // Parts of its edges move otherwise than others.
    let turns = GeometryChange::Rotate { axis: Vec3::Y, pivot: vec3(0.0, 0.0, -1.5) };
    let parameters = [
        parameter("slides", 0.0, vec![moves("body", shifted(1.0, 0.0, 0.0))]),
        parameter("turns", 0.0, vec![moves("body", turns)]),
    ];
    check(&glowing(0.3, beam), &parameters);
}

/// The camera moves as both do, and each sample shows nothing.
#[test]
fn what_moves_together_turns_no_ray() {
    let wall = procedural::grid(3, 4).transform(&turned(Vec3::Y, Vec3::ZERO));
    let together = ["camera", "floor", "body"].map(|id| moves(id, shifted(0.4, 0.7, -0.2)));
    let parameters = [parameter("together", 0.0, together.into())];
    let settings = Settings { estimator: Warped, ..Settings::default() };
    let rendering = rendered(&glowing(9.0, wall), &parameters, &settings, 256);
    let total = &rendering.derivatives[0].total;
    assert!(rendering.image.rms_value() > 0.1);
    assert!(total.rms_value() < 1e-9, "{}", total.rms_value());
}
