//! Stages lit by lights without a shape.

use std::f64::consts::FRAC_PI_2;

use drt_estimators::emitter::Emitter;
use drt_geom::procedural::{cube, rectangle};
use drt_math::{Mat3, Rgb, Vec3, vec3};
use drt_motion::GeometryChange;

use super::effects::{add, raise, translate, turn};
use super::set::{diffuse, placed};
use super::{Cell, Set, Stage};
use crate::Result;
use crate::motion::moves;

/// A floor with a box floating above, seen from above.
fn floor_and_box() -> Result<Set> {
    let floor =
        placed(&rectangle(), vec3(1.5, 1.5, 1.0), Vec3::X, -FRAC_PI_2, vec3(0.0, -0.7, 0.0));
    let body = placed(&cube(), vec3(0.3, 0.15, 0.25), vec3(0.2, 1.0, 0.3), 0.7, Vec3::ZERO);
    Ok(Set::new(vec3(0.2, 1.7, -2.4), vec3(0.0, -0.4, 0.0), 42.0, 3)?
        .shape("floor", floor, diffuse([0.7, 0.6, 0.4]))
        .shape("box", body, diffuse([0.4, 0.5, 0.8])))
}

/// A spot light.
///
/// # Errors
/// When the library rejects the scene.
pub fn spot() -> Result<Stage> {
    let position = vec3(0.6, 1.6, -0.5);
    let emitter = Emitter::Spot {
        position,
        direction: vec3(-0.3, -1.0, 0.3),
        intensity: Rgb::new(6.0, 7.0, 8.0),
        cutoff_angle: 0.5,
        beam_width: 0.25,
    };
    let scene = floor_and_box()?.light("spot", emitter).scene;
    let cells = vec![
        Cell::new("spot moves", [translate("spot", vec3(0.5, 0.2, 0.3))]).representative(),
        Cell::new("spot turns", [turn("spot", vec3(1.0, 0.2, 0.5), position)]).precise(),
        Cell::new("cutoff angle", [raise("spot", "cutoff_angle", 20.0)]).representative().precise(),
        Cell::new("beam width", [raise("spot", "beam_width", 20.0)]),
        Cell::new("intensity", [add("spot", "intensity", [1.0, 2.0, 3.0])]).precise().samples(512),
        Cell::new("box turns", [turn("box", vec3(0.5, 1.0, 0.0), vec3(0.2, 0.0, 0.0))]),
    ];
    Ok(Stage::new("spot", scene, cells))
}

/// A point light and a distant one.
///
/// # Errors
/// When the library rejects the scene.
pub fn point_and_sun() -> Result<Stage> {
    let point =
        Emitter::Point { position: vec3(-0.5, 1.2, 0.3), intensity: Rgb::new(2.0, 1.5, 1.0) };
    let sun = Emitter::Directional {
        direction: vec3(-0.6, -1.0, 0.2),
        irradiance: Rgb::new(0.8, 1.0, 1.6),
    };
    let scene = floor_and_box()?.light("point", point).light("sun", sun).scene;
    let stretch = GeometryChange::Matrix(drt_math::Affine {
        linear: Mat3::from_rows(vec3(0.5, 0.2, 0.0), vec3(0.0, -0.4, 0.0), vec3(0.0, 0.3, 0.6)),
        translation: vec3(0.2, 0.1, 0.0),
    });
    let cells = vec![
        Cell::new("point light moves", [translate("point", vec3(0.5, -0.3, 0.4))]),
        Cell::new("sun turns", [turn("sun", vec3(0.5, 0.1, 1.0), Vec3::ZERO)]).representative(),
        Cell::new("box moves", [translate("box", vec3(0.4, 0.3, -0.5))]),
        Cell::new("floor rises", [translate("floor", vec3(0.0, 1.0, 0.0))]),
        Cell::new("irradiance", [add("sun", "irradiance", [1.0, 0.5, 0.2])]).samples(512),
        Cell::new(
            "everything stretched",
            ["floor", "box", "point", "sun"].map(|t| moves(t, stretch.clone())),
        ),
    ];
    Ok(Stage::new("point and sun", scene, cells))
}
