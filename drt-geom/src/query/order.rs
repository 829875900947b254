//! The order of hits along a ray where surfaces coincide.
//!
//! A floor on which a box of fog stands, or a lamp in the plane of a ceiling, is met at one and the same distance as what it
//! coincides with, and which of the two computed distances is less is a matter of rounding, other for each ray. So hits whose
//! points lie in each other's planes, as far as the rounding of coordinates and of distances along the ray lets one tell,
//! count as equally far, and the triangle with the lower number comes first.

use drt_math::Vec3;

use super::ends::{End, gamma};
use super::watertight::{Corners, Crossing};
use super::{Hit, Ray};

/// How near two hits are that are looked at more closely, relative to their distance.
const NEAR: f64 = 1e-6;

/// Bound of the relative error of a distance along a ray.
const ALONG: f64 = gamma(16.0);

/// The first hit of a ray so far, and its triangle.
pub(super) struct First {
    pub(super) hit: Hit,
    corners: Corners,
}

impl First {
    #[inline(always)]
    pub(super) fn new(prim: u32, crossing: &Crossing, corners: &Corners) -> Self {
        Self { hit: super::hit(prim, crossing), corners: *corners }
    }

    /// Whether another hit of the ray comes before this one.
    #[inline(always)]
    pub(super) fn is_after(
        &self,
        ray: &Ray,
        prim: u32,
        crossing: &Crossing,
        corners: &Corners,
    ) -> bool {
        if (crossing.t - self.hit.t).abs() > NEAR * self.hit.t {
            return crossing.t < self.hit.t;
        }
        self.follows_nearly(ray, &super::hit(prim, crossing), corners)
    }

    #[cold]
    fn follows_nearly(&self, ray: &Ray, other: &Hit, corners: &Corners) -> bool {
        if lies_in_plane(ray, &self.hit, &self.corners, corners)
            && lies_in_plane(ray, other, corners, &self.corners)
        {
            other.prim < self.hit.prim
        } else {
            other.is_before(&self.hit)
        }
    }
}

fn lies_in_plane(ray: &Ray, hit: &Hit, own: &Corners, other: &Corners) -> bool {
    let (origin, dir) = (ray.origin.to_array(), ray.dir.to_array());
    let error = [0, 1, 2].map(|k| ALONG * (origin[k].abs() + (hit.t * dir[k]).abs()));
    let point = hit.point(own.map(Vec3::from));
    End::with_error(point.to_array(), error).lies_in_plane(other)
}

/// Whether the triangle `other` is met as far along the ray as its `hit` on the triangle `own`, as far as rounding lets one tell.
///
/// The ray must pass through the other triangle's outline; only distances are compared.
#[must_use]
pub fn coincide(ray: &Ray, hit: &Hit, own: [Vec3; 3], other: [Vec3; 3]) -> bool {
    lies_in_plane(ray, hit, &own.map(|v| v.to_array()), &other.map(|v| v.to_array()))
}
