use drt_math::fm;

use crate::model::sensor::{SensorError, finite};

/// The side of the film that the field of view is measured along.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum FovAxis {
    /// The width.
    #[default]
    X,
    /// The height.
    Y,
    /// From corner to opposite corner.
    Diagonal,
    /// The shorter side.
    Smaller,
    /// The longer side.
    Larger,
}

/// What maps directions to the film, and the depths seen. Names and meaning are Mitsuba's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Lens {
    /// Field of view in degrees, between 0 and 180.
    pub fov: f64,
    /// What it is measured along.
    pub fov_axis: FovAxis,
    /// How far the forward axis meets the film left of and above its centre, in film widths and
    /// heights.
    pub principal_point_offset: [f64; 2],
    /// Depth along the forward axis before which nothing is seen.
    pub near: f64,
    /// Depth beyond which nothing is seen.
    pub far: f64,
}

impl Default for Lens {
    /// Mitsuba's: a focal length of 50 mm on 36 × 24 mm film, clipped at 0.01 and 10⁴.
    fn default() -> Self {
        Self { fov_axis: FovAxis::Diagonal, ..Self::with_fov(Self::fov_of_focal_length(50.0)) }
    }
}

impl Lens {
    /// A horizontal field of view in degrees, everything else as in Mitsuba.
    #[must_use]
    pub const fn with_fov(fov: f64) -> Self {
        Self { fov, fov_axis: FovAxis::X, principal_point_offset: [0.0, 0.0], near: 1e-2, far: 1e4 }
    }

    /// The diagonal field of view in degrees of a focal length in millimetres, for film of
    /// 36 × 24 mm.
    #[must_use]
    pub fn fov_of_focal_length(millimetres: f64) -> f64 {
        2.0 * fm::atan(fm::sqrt(36.0 * 36.0 + 24.0 * 24.0) / (2.0 * millimetres)).to_degrees()
    }

    /// Checks the lens and gives the side of a pixel on the plane at distance one, for a film of a width and height in pixels.
    ///
    /// # Errors
    /// When the field of view, the clip planes or the principal point cannot be used.
    pub fn pixel_size(&self, film: [f64; 2]) -> Result<f64, SensorError> {
        if !(self.fov > 0.0 && self.fov < 180.0) {
            return Err(SensorError::FieldOfView(self.fov));
        }
        if !(0.0 < self.near && self.near < self.far) {
            return Err(SensorError::Clip { near: self.near, far: self.far });
        }
        let offset = self.principal_point_offset;
        finite(offset.iter().all(|o| o.is_finite()), "principal point offset")?;
        Ok(2.0 * fm::tan(self.half_angle()) / self.pixels_along_axis(film))
    }

    /// Derivative of the pixel size with respect to the field of view in degrees.
    pub(super) fn pixel_size_slope(&self, film: [f64; 2]) -> f64 {
        let t = fm::tan(self.half_angle());
        1.0_f64.to_radians() * (1.0 + t * t) / self.pixels_along_axis(film)
    }

    /// Pixel coordinates of the forward axis.
    pub(super) fn principal_point(&self, film: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| film[k] * (0.5 - self.principal_point_offset[k]))
    }

    fn half_angle(&self) -> f64 {
        0.5 * self.fov.to_radians()
    }

    fn pixels_along_axis(&self, [w, h]: [f64; 2]) -> f64 {
        match self.fov_axis {
            FovAxis::X => w,
            FovAxis::Y => h,
            FovAxis::Diagonal => fm::sqrt(w * w + h * h),
            FovAxis::Smaller => f64::min(w, h),
            FovAxis::Larger => f64::max(w, h),
        }
    }
}
