//! Where rays pass through the faces of a grid's box.

use drt_math::{Affine, Rgb, RgbVec, Vec3};

use crate::bounds::clip_to_box;
use crate::{GridMedium, Ray};

/// A place where a ray passes through a face of a grid's box, and the extinction jumps to zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
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
