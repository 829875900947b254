//! Detectors as sensors of one pixel.

use std::f64::consts::PI;

use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_math::{Affine, Mat3, Vec3};

use crate::Result;
use crate::oracle::{Camera, Detector, Triple};

/// Half the side of the pixel that stands for a ray. A tent of half side h sees L + h²/12 ΔL: for
/// light that varies over angles of 0.1 or more, less than 10⁻⁴ off. Narrower pixels cost: mirrored
/// samples that part ways count 1/h when the image moves.
const RAY: f64 = 2e-3;

/// Relative deviation that the finite width of a ray may cause.
pub const RAY_BIAS: f64 = 1e-4;

/// A point or vector.
#[must_use]
pub fn vector([x, y, z]: Triple) -> Vec3 {
    drt_math::vec3(x, y, z)
}

/// The sensor that measures what a detector does.
///
/// # Errors
/// When the detector is none, or has a filter of another kind than the file's conventions know.
pub fn sensor(detector: &Detector) -> Result<Sensor> {
    match detector {
        Detector::Irradiance { point, normal } => {
            Ok(Sensor::irradiance_meter(vector(*point), vector(*normal))?)
        }
        Detector::Radiance { .. } => sensor(&detector.clone().widened(RAY)),
        Detector::PinholePixel { camera, filter, center, half_width } => {
            if filter != "tent" {
                return Err(format!("unknown pixel filter `{filter}`").into());
            }
            let Camera { position, right, up, forward } = *camera;
            pixel([right, up, forward].map(vector), vector(position), *center, *half_width)
        }
        Detector::Words => Err("the detector is described in words only".into()),
    }
}

/// A pixel with a tent filter of half side `h` around an image point. A tent's radius is one pixel,
/// so that the pixel's side is h.
fn pixel(
    [right, up, forward]: [Vec3; 3],
    position: Vec3,
    center: [f64; 2],
    h: f64,
) -> Result<Sensor> {
    let to_world = Affine { linear: Mat3 { cols: [-right, up, forward] }, translation: position };
    let lens = Lens {
        // The one pixel spans the field of view.
        fov: 2.0 * (0.5 * h).atan() * 180.0 / PI,
        principal_point_offset: [center[0] / h, -center[1] / h],
        near: 1e-9,
        far: 1e9,
        ..Lens::with_fov(1.0)
    };
    Ok(Sensor::from_to_world(&to_world, lens, [1, 1], Filter::new(FilterKind::TENT)?)?)
}
