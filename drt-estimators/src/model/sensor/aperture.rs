//! Thin lenses: cameras that focus.
//!
//! The lens is a disk of radius R through the position p, across the forward axis f. A point ξ of the unit disk stands for its
//! point p + R (ξ_1 r + ξ_2 u). Every ray of an image point meets the same point of the plane of focus, at depth F; the value of
//! a pixel is the mean over ξ of what a pinhole at that point of the lens sees (Cook, Porter and Carpenter 1984; weights and
//! units are those of Mitsuba's `thinlens`).
//!
//! A point x at depth z, seen from the lens point e, meets the plane of focus at e + (x - e) F/z. As the pinhole sees that
//! at the coordinate a, e.g. along r,
//!
//! ```text
//! a = (R ξ_1 + (x - e)·r F/z) / F = (x - e)·r / z + R ξ_1 / F.
//! ```
//!
//! So the camera of one ξ is a pinhole at e, whose principal point is shifted by R ξ_1/(F s) and -R ξ_2/(F s) pixels:
//! [`Sensor::at_lens`]. It has a film, edges and derivatives as any other; as ξ does not depend on parameters, derivatives of
//! the mean are means of derivatives, those by this pinhole carried back to the camera by
//! [`lens_gradient`](Sensor::lens_gradient).

use alloc::borrow::Cow;
use core::f64::consts::PI;

use drt_math::{Rng, fm};

use crate::model::sensor::{Sensor, SensorError, SensorGradient};

/// The lens of a camera that focuses, and where it does. Names and meaning are Mitsuba's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Aperture {
    /// The lens's radius, in units of the world.
    pub radius: f64,
    /// Depth along the forward axis of the plane that is sharp, in units of the world.
    pub focus_distance: f64,
}

impl Aperture {
    fn check(self) -> Result<Self, SensorError> {
        let Self { radius, focus_distance } = self;
        for (value, what) in [(radius, "aperture_radius"), (focus_distance, "focus_distance")] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(SensorError::Aperture { what, value });
            }
        }
        Ok(self)
    }
}

impl Sensor {
    /// The same camera with a lens.
    ///
    /// # Errors
    /// When the radius or the focus distance is not a positive number, or the sensor is no perspective camera.
    pub fn with_aperture(self, aperture: Aperture) -> Result<Self, SensorError> {
        if self.is_orthographic() || self.response() == super::Response::Irradiance {
            return Err(SensorError::NoLens);
        }
        Ok(Self { aperture: Some(aperture.check()?), ..self })
    }

    /// The lens; `None` of a pinhole.
    #[inline]
    #[must_use]
    pub fn aperture(&self) -> Option<Aperture> {
        self.aperture
    }

    /// Draws a point of the unit disk evenly. Without a lens it is the middle, and no numbers are drawn.
    #[inline]
    pub(crate) fn draw_lens(&self, rng: &mut Rng) -> [f64; 2] {
        if self.aperture.is_none() {
            return [0.0; 2];
        }
        let [u, v] = rng.next_2d();
        let (sin, cos) = fm::sin_cos(2.0 * PI * v);
        [fm::sqrt(u) * cos, fm::sqrt(u) * sin]
    }

    /// The camera as it is for a point of its lens, given on the unit disk: a pinhole.
    #[must_use]
    pub fn at_lens(&self, lens: [f64; 2]) -> Cow<'_, Self> {
        let Some(Aperture { radius, focus_distance }) = self.aperture else {
            return Cow::Borrowed(self);
        };
        let mut pinhole = self.pinhole;
        let [u, v] = lens.map(|x| x * radius);
        pinhole.position += pinhole.right * u + pinhole.up * v;
        let per_pixel = 1.0 / (focus_distance * pinhole.pixel_size);
        pinhole.principal[0] += u * per_pixel;
        pinhole.principal[1] -= v * per_pixel;
        Cow::Owned(Self { pinhole, aperture: None, ..self.clone() })
    }

    /// The gradient of a number by the camera, from that by the pinhole [`at_lens`](Self::at_lens).
    #[must_use]
    pub fn lens_gradient(&self, lens: [f64; 2], by: SensorGradient) -> SensorGradient {
        let Some(Aperture { radius, focus_distance }) = self.aperture else { return by };
        let p = &self.pinhole;
        let [u, v] = lens.map(|x| x * radius);
        let per_pixel = 1.0 / (focus_distance * p.pixel_size);
        let [x, y] = by.principal;
        // Of the shift of the principal point by a factor common to both of its coordinates.
        let shift = (u * x - v * y) * per_pixel;
        SensorGradient {
            right: by.right + by.position * u,
            up: by.up + by.position * v,
            pixel_size: by.pixel_size - shift / p.pixel_size,
            aperture_radius: shift / radius + by.position.dot(p.right * lens[0] + p.up * lens[1]),
            focus_distance: -shift / focus_distance,
            ..by
        }
    }
}
