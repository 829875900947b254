//! Derivatives of transmittance: `T' = -T tau'`, with two independent unbiased estimates for the
//! two factors.

use alloc::vec::Vec;

use drt_math::{Affine, Rgb, RgbVec, Rng, Vec3};

use crate::bounds::clip_to_box;
use crate::{DepthEstimate, GridMedium, Medium, MediumTangent, Ray, TrackingStats};

/// A place where a ray passes through a face of a grid's box, and the extinction jumps to zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance along the ray.
    pub t: f64,
    /// Unit normal of the face, out of the box.
    pub normal: Vec3,
    /// Cosine between the ray and the normal: negative at the entry.
    pub cosine: f64,
    /// Extinction just inside.
    pub sigma_t: Rgb,
}

impl Crossing {
    /// Derivative of the ray's optical depth with respect to the velocity of the face, for a fixed
    /// ray: `sigma_t n / |n . dir|`. Where the box grows, the ray gets longer inside. A ray point
    /// that moves itself has the opposite effect.
    #[inline]
    #[must_use]
    pub fn depth_per_velocity(&self) -> RgbVec {
        self.sigma_t.outer(self.normal / self.cosine.abs())
    }

    /// Rate of the optical depth for a velocity of the face relative to the ray.
    #[inline]
    #[must_use]
    pub fn depth_rate(&self, velocity: Vec3) -> Rgb {
        self.depth_per_velocity().dot(velocity)
    }
}

impl GridMedium {
    /// The entry and the exit of a ray through the faces of the density grid's box, as far as they
    /// lie inside the ray.
    ///
    /// Faces closer to the ray's ends than a part in 10⁹ of the box are left out: a surface that
    /// bounds the medium there owns the jump.
    pub fn crossings(&self, ray: &Ray) -> impl Iterator<Item = Crossing> + '_ {
        let ends = clip_to_box(self.density(), ray).map(<[f64; 2]>::from).unwrap_or([-1.0; 2]);
        let margin = self.crossing_margin();
        let ray = *ray;
        ends.into_iter()
            .filter(move |&t| t > margin && t < ray.t_max - margin)
            .map(move |t| self.crossing(self.density().from_world(), &ray, t))
    }

    /// How near to a ray's ends faces are left out.
    pub(crate) fn crossing_margin(&self) -> f64 {
        1e-9 * self.density().world_extent().max_abs()
    }

    /// The crossing at a distance, `unit` being the map to the unit cube there.
    pub(crate) fn crossing(&self, unit: &Affine, ray: &Ray, t: f64) -> Crossing {
        let u = unit.point(ray.at(t));
        let offset = (u - Vec3::splat(0.5)).to_array();
        let mut axis = 0;
        for k in 1..3 {
            if offset[k].abs() > offset[axis].abs() {
                axis = k;
            }
        }
        // Normals go with the transposed inverse of the placement.
        let mut face = [0.0; 3];
        face[axis] = if offset[axis] > 0.0 { 1.0 } else { -1.0 };
        let normal = unit.linear.transpose_mul(face.into()).normalize();
        let inside = u.max(Vec3::ZERO).min(Vec3::splat(1.0));
        Crossing {
            t,
            normal,
            cosine: normal.dot(ray.dir),
            sigma_t: self.density().value_at_unit(inside) * self.scale(),
        }
    }
}

/// An unbiased estimate of a transmittance and of its derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
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
        self.line_points(ray.origin, ray.dir, ray.t_max, rng, points);
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
        let value = self.transmittance(ray.origin, ray.dir, ray.t_max, rng, stats);
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
    /// `d tau = (dR / R) tau + R ∫ grad sigma . dz ds - sum sigma N . dz / |c|`.
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
        self.line_points(ray.origin, ray.dir, length, rng, points);
        let e = DepthEstimate::inside(self, *ray, points, true).with_faces(self);
        let end = (e.moment + e.depth.outer(ray.dir)) * (1.0 / length);
        [e.gradient - end, end]
    }
}
