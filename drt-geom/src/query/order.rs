//! The order of hits along a ray where surfaces coincide.
//!
//! A floor on which a box of fog stands, or a lamp in the plane of a ceiling, is met at one and the same distance as what it
//! coincides with, and which of the two computed distances is less is a matter of rounding, other for each ray. So hits whose
//! points lie in each other's planes, as far as the rounding of coordinates and of distances along the ray lets one tell,
//! count as equally far, and the triangle with the lower number comes first.

use alloc::vec::Vec;

use drt_math::{Ray, Vec3};

use super::Hit;
use super::ends::{End, gamma};
use super::watertight::{Corners, Crossing};

/// How near two hits are that are looked at more closely, relative to their distance.
const NEAR: f64 = 1e-6;

/// Bound of the relative error of a distance along a ray.
const ALONG: f64 = gamma(16.0);

/// A triangle that a ray crosses.
struct Met {
    prim: u32,
    crossing: Crossing,
    corners: Corners,
}

/// The nearest hit of a ray so far, and those that are hardly farther.
#[derive(Default)]
pub(super) struct Foremost {
    nearest: Option<Met>,
    near: Vec<Met>,
}

impl Met {
    fn hit(&self) -> Hit {
        super::hit(self.prim, &self.crossing)
    }
}

impl Foremost {
    /// Takes in a hit; true where it is the nearest so far.
    #[inline(always)]
    pub(super) fn take(&mut self, prim: u32, crossing: &Crossing, corners: &Corners) -> bool {
        let met = || Met { prim, crossing: *crossing, corners: *corners };
        if let Some(nearest) = &self.nearest {
            let (t, near) = (nearest.crossing.t, NEAR * nearest.crossing.t);
            if crossing.t > t + near {
                return false;
            }
            if crossing.t >= t - near {
                return self.take_near(met());
            }
        }
        self.near.clear();
        self.nearest = Some(met());
        true
    }

    #[cold]
    fn take_near(&mut self, met: Met) -> bool {
        let Some(nearest) = &mut self.nearest else { return false };
        let nearer = met.hit().is_before(&nearest.hit());
        self.near.push(if nearer { core::mem::replace(nearest, met) } else { met });
        nearer
    }

    /// The first hit: of those that coincide with the nearest one, that on the triangle with the lowest number. Which it is does
    /// not depend on the order in which they were found.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &Ray) -> Option<Hit> {
        let nearest = self.nearest.as_ref()?;
        Some(if self.near.is_empty() { nearest.hit() } else { self.lowest(ray, nearest) })
    }

    #[cold]
    fn lowest(&self, ray: &Ray, nearest: &Met) -> Hit {
        let place = |met: &Met| (met.hit(), met.corners.map(Vec3::from));
        let (first, of_first) = place(nearest);
        let coincides = |met: &&Met| {
            let (hit, corners) = place(met);
            coincide(ray, (&first, of_first), (&hit, corners))
        };
        let others = self.near.iter().filter(coincides);
        others.fold(nearest, |first, met| if met.prim < first.prim { met } else { first }).hit()
    }
}

/// Whether a ray meets two triangles at one and the same distance, as far as the rounding of coordinates and of distances along the
/// ray lets one tell: each hit lies in the plane of the other's triangle.
#[must_use]
pub fn coincide(ray: &Ray, a: (&Hit, [Vec3; 3]), b: (&Hit, [Vec3; 3])) -> bool {
    let corners = |triangle: [Vec3; 3]| triangle.map(|v| v.to_array());
    let [of_a, of_b] = [corners(a.1), corners(b.1)];
    a.0.is_near(b.0)
        && lies_in_plane(ray, a.0, &of_a, &of_b)
        && lies_in_plane(ray, b.0, &of_b, &of_a)
}

impl Hit {
    /// Whether another hit of the same ray is so near that both triangles may [coincide].
    #[inline]
    #[must_use]
    pub fn is_near(&self, other: &Self) -> bool {
        (self.t - other.t).abs() <= NEAR * self.t.max(other.t)
    }
}

fn lies_in_plane(ray: &Ray, hit: &Hit, own: &Corners, other: &Corners) -> bool {
    let (origin, dir) = (ray.origin.to_array(), ray.dir.to_array());
    let error = [0, 1, 2].map(|k| ALONG * (origin[k].abs() + (hit.t * dir[k]).abs()));
    let point = hit.point(own.map(Vec3::from));
    End::with_error(point.to_array(), error).lies_in_plane(other)
}
