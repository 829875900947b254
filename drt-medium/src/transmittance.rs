//! Derivatives of transmittance: `T' = -T tau'`, with two independent unbiased estimates for the
//! two factors.

use alloc::vec::Vec;

use drt_math::{Rgb, RgbVec, Rng};

use crate::{DepthEstimate, Medium, MediumTangent, Ray, TrackingStats};

/// An unbiased estimate of a transmittance and of its derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TransmittanceRate {
    /// The transmittance.
    pub value: Rgb,
    /// Its derivative with respect to the parameter.
    pub rate: Rgb,
}

impl Medium {
    /// Unbiased estimate of the derivative of the optical depth `∫ sigma_t` of a fixed ray along a
    /// tangent, moving faces of the grid's box included. `points` is scratch space.
    pub fn optical_depth_rate(
        &self,
        ray: &Ray,
        tangent: &MediumTangent,
        rng: &mut Rng,
        points: &mut Vec<(f64, f64)>,
    ) -> Rgb {
        if self.extinction().is_some() {
            let rate = tangent.rates(self, ray.origin).sigma_t;
            return rate.map(|r| if r == 0.0 { 0.0 } else { r * ray.t_max });
        }
        points.clear();
        self.line_points(ray, rng, points);
        let moving = tangent.moves_grids();
        let depth = DepthEstimate::inside(self, *ray, points, moving);
        let depth = if moving { depth.with_faces(self) } else { depth };
        depth.rate(self, tangent)
    }

    /// Unbiased estimates of the transmittance of a fixed ray and of its derivative along a
    /// tangent. `points` is scratch space.
    pub fn transmittance_rate(
        &self,
        ray: &Ray,
        tangent: &MediumTangent,
        rng: &mut Rng,
        stats: &mut TrackingStats,
        points: &mut Vec<(f64, f64)>,
    ) -> TransmittanceRate {
        let value = self.transmittance(ray, rng, stats);
        let depth = self.optical_depth_rate(ray, tangent, rng, points);
        let rate = crate::tracking::zip(value, depth, |t, d| if t == 0.0 { 0.0 } else { -t * d });
        TransmittanceRate { value, rate }
    }

    /// Unbiased estimate of the gradients of the optical depth of the segment from `ray.origin` to
    /// `ray.at(t_max)` with respect to its two end points, for a medium at rest; `ray.t_max` must be
    /// finite. `points` is scratch space.
    ///
    /// With `R` the length, `z(s)` the points of the segment and N, c the normals and cosines of
    /// the box's faces it crosses:
    /// `d tau = (dR / R) tau + R ∫ grad sigma . dz ds - sum sigma N . dz / |c|`. Microflakes add the derivative by the
    /// direction.
    pub fn optical_depth_gradient(
        &self,
        ray: &Ray,
        rng: &mut Rng,
        points: &mut Vec<(f64, f64)>,
    ) -> [RgbVec; 2] {
        let length = ray.t_max;
        if let Some(h) = self.extinction() {
            let end = h.coefficients().sigma_t.outer(ray.dir);
            return [-end, end];
        }
        points.clear();
        self.line_points(ray, rng, points);
        let e = DepthEstimate::inside(self, *ray, points, true).with_faces(self);
        let end = (e.moment + e.depth().outer(ray.dir) + e.turn) * (1.0 / length);
        [e.gradient - end, end]
    }
}
