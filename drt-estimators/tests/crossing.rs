//! Surfaces that pass through each other: the line where they meet is an edge that no mesh has.

mod common;

use common::*;
use drt_estimators::EstimatorKind::{PathSpace, Radiative, Warped};
use drt_estimators::emitter::Emitter;
use drt_estimators::{Layer, Scene, Settings, Unattended, agreement, finite_differences};
use drt_geom::procedural;
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_motion::GeometryChange;

/// A floor and a wall through it, both glow. Their rims are out of view; of the floor's edges one is where the wall
/// is, unless that is `off` it.
fn glowing(off: f64) -> Scene {
    let mut b = Build::default();
    let black = b.bsdf("black", diffuse(0.0, 0.0, 0.0));
    let [dim, bright] = [("dim", 0.5), ("bright", 2.0)].map(|(id, radiance)| {
        b.light(id, Emitter::Area { radiance: Rgb::new(radiance, 1.0, 0.7 * radiance) })
    });
    let turned = |axis, angle, translation| Affine {
        linear: Mat3::rotation(axis, angle) * 9.0,
        translation,
    };
    let quarter = -core::f64::consts::FRAC_PI_2;
    let floor = procedural::grid(2, 2).transform(&turned(Vec3::X, quarter, Vec3::ZERO));
    b.shape("floor", floor, black).emitter = Some(dim);
    let wall = procedural::grid(3, 4).transform(&turned(Vec3::Y, -quarter, vec3(off, 0.0, 0.0)));
    b.shape("wall", wall, black).emitter = Some(bright);
    b.camera(vec3(1.5, 1.4, 3.0), vec3(0.0, 0.0, 0.0), 1)
}

fn sum(layer: &Layer) -> [f64; 2] {
    let mean = layer.pixels.iter().map(|p| p.mean.sum()).sum();
    let variance: f64 = layer.pixels.iter().map(|p| (p.stderr * p.stderr).sum()).sum();
    [mean, variance.sqrt()]
}

/// What is seen beside the line changes with it alone.
#[test]
fn the_line_moves_with_both() {
    let tilt = GeometryChange::Rotate { axis: vec3(0.3, 0.2, 1.0), pivot: vec3(0.5, 0.0, 0.0) };
    let shifted = |x, y, z| GeometryChange::Translate(vec3(x, y, z));
    let parameters = [
        parameter("wall", 0.0, vec![moves("wall", shifted(1.0, 0.4, 0.3))]),
        parameter("floor", 0.0, vec![moves("floor", tilt)]),
        parameter(
            "both",
            0.0,
            vec![moves("wall", shifted(0.5, 0.3, 0.0)), moves("floor", shifted(0.2, 0.8, 0.1))],
        ),
    ];
    for off in [0.0, 0.07] {
        let scene = glowing(off);
        let settings = Settings::default();
        let differences =
            finite_differences(&scene, &parameters, &settings, 131_072, 0.01, &Unattended);
        let differences = differences.expect("a valid scene");
        for estimator in [PathSpace, Radiative, Warped] {
            let settings = Settings { estimator, ..Settings::default() };
            let rendering = rendered(&scene, &parameters, &settings, 32_768);
            for (d, expected) in rendering.derivatives.iter().zip(&differences) {
                let found = agreement(&d.total, expected, None);
                assert!(found.agrees, "{off} {estimator:?} {} {found:?}", d.name);
                let ([own, error], [other, other_error]) = (sum(&d.total), sum(expected));
                let error = error.hypot(other_error);
                println!("{estimator:?} {} {own} {other} +- {error}", d.name);
                assert!((own - other).abs() < 4.0 * error, "{own} {other} +- {error}");
                assert!(error < 0.02 * other.abs(), "{own} {other} +- {error}");
                // Planted: a fifth is missing.
                let faulty = agreement(&multiple(&d.total, 0.8), expected, None);
                assert!(!faulty.agrees, "{off} {estimator:?} {} {faulty:?}", d.name);
            }
        }
    }
}
