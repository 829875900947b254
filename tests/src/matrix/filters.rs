//! Stages for what pixels do at their borders: a body that the camera sees, by each filter, surface and light.

use std::f64::consts::FRAC_PI_2;

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::FilterKind;
use drt_geom::procedural::{icosphere, rectangle, uv_sphere};
use drt_math::{Rgb, Vec3, vec3};

use super::effects::translate;
use super::set::{at, diffuse, placed};
use super::textures::{by_place, coloured};
use super::{Cell, Set, Stage};
use crate::Result;

/// Every kind of filter, those that jump first.
pub const FILTERS: [FilterKind; 5] = [
    FilterKind::BOX,
    FilterKind::TENT,
    FilterKind::Gaussian { radius: 2.0, std_dev: 0.5 },
    FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
    FilterKind::Lanczos { lobes: 3 },
];

/// What the camera sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    /// Facets of a ball.
    Flat,
    /// A ball with interpolated normals, whose pole faces the camera: its meridians lie along borders of pixels.
    Smooth,
    /// A ball that shines.
    Emitting,
    /// A ball with a pattern on it.
    Textured,
}

/// What lights the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// A sky.
    Constant,
    /// A rectangle behind the camera.
    Area,
    /// A point.
    Point,
}

/// Every kind of body.
pub const BODIES: [Body; 4] = [Body::Flat, Body::Smooth, Body::Emitting, Body::Textured];

/// Every kind of light.
pub const LIGHTS: [Light; 3] = [Light::Constant, Light::Area, Light::Point];

/// A body before a camera that looks straight at it; either moves.
///
/// # Errors
/// When the library rejects the scene.
pub fn bordered(filter: FilterKind, body: Body, light: Light) -> Result<Stage> {
    let set = Set::facing(vec3(0.0, 0.0, 4.0), Vec3::ZERO, 40.0, 2)?.filter(filter)?;
    let white = diffuse([0.7, 0.6, 0.5]);
    let faceted = placed(&icosphere(2), Vec3::splat(1.0), Vec3::X, 0.3, Vec3::ZERO);
    let smooth = uv_sphere(8).with_smooth_normals();
    let set = match body {
        Body::Flat => set.shape("body", faceted, white),
        Body::Smooth => set.shape("body", smooth, white),
        Body::Emitting => set.lamp(
            "body",
            at(&icosphere(1), Vec3::splat(1.0), Vec3::ZERO),
            Rgb::new(1.0, 2.0, 3.0),
        ),
        Body::Textured => set.shape("body", by_place(smooth)?, coloured()?),
    };
    let set = match light {
        Light::Constant => {
            set.light("sky", Emitter::Constant { radiance: Rgb::new(1.0, 0.9, 0.8) })
        }
        Light::Area => {
            let lamp = placed(
                &rectangle(),
                vec3(1.5, 1.5, 1.0),
                Vec3::X,
                FRAC_PI_2 * 2.0,
                vec3(1.0, 1.5, 6.0),
            );
            set.lamp("lamp", lamp, Rgb::new(4.0, 5.0, 6.0))
        }
        Light::Point => {
            let (position, intensity) = (vec3(1.0, 1.2, 5.0), Rgb::new(30.0, 25.0, 20.0));
            set.light("point", Emitter::Point { position, intensity })
        }
    };
    let cells = vec![
        Cell::new("body moves", [translate("body", vec3(1.0, 0.3, 0.2))]),
        Cell::new("camera moves", [translate("camera", vec3(0.7, -0.4, 0.5))]),
    ];
    Ok(Stage::new("bordered", set.scene, cells))
}
