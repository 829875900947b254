use core::f64::consts::PI;
use core::ops::ControlFlow;

use drt_math::{Rng, Vec3, fm, vec3};

use super::{Ray, Skip, TriangleBvh};

/// How many directions are tried before the sum over all solid angles decides.
const DIRECTIONS: u32 = 16;

impl TriangleBvh {
    /// How often the surface winds around `p`: for a closed mesh with outward normals 1 inside and
    /// 0 outside; more where closed parts overlap, negative where they are inside out.
    ///
    /// Counts signed crossings along a ray. A ray that meets an edge exactly would count both
    /// faces; the triangle test tells such rays, and another direction is taken. Meaningless for a
    /// `p` on the surface and for open meshes.
    #[must_use]
    pub fn winding_number(&self, p: Vec3) -> i32 {
        if !self.bounds.contains(p) {
            return 0;
        }
        let mut directions = Rng::new(0, 0, 0);
        (0..DIRECTIONS)
            .find_map(|_| self.signed_crossings(p, any_direction(&mut directions)))
            .unwrap_or_else(|| fm::round(self.solid_angle(p) / (4.0 * PI)) as i32)
    }

    /// Whether `p` is inside: the surface winds around it.
    #[must_use]
    pub fn inside(&self, p: Vec3) -> bool {
        self.winding_number(p) != 0
    }

    /// Crossings from inside to outside less those from outside to inside; `None` when the ray
    /// meets an edge.
    fn signed_crossings(&self, p: Vec3, dir: Vec3) -> Option<i32> {
        let probe = self.probe(&Ray::new(p, dir), Skip::NOTHING)?;
        let mut sum = 0;
        let mut met_edge = false;
        self.visit(&probe, |_, crossing| {
            if crossing.is_on_edge() {
                met_edge = true;
                return ControlFlow::Break(());
            }
            sum += if crossing.det < 0.0 { 1 } else { -1 };
            ControlFlow::Continue(f32::INFINITY)
        });
        (!met_edge).then_some(sum)
    }

    /// The signed solid angle of all triangles seen from `p` (van Oosterom and Strackee 1983).
    fn solid_angle(&self, p: Vec3) -> f64 {
        let half = |corners: [Vec3; 3]| {
            let [a, b, c] = corners.map(|v| v - p);
            let [la, lb, lc] = [a.length(), b.length(), c.length()];
            let cosine = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            fm::atan2(a.dot(b.cross(c)), cosine)
        };
        self.slots.iter().map(|s| 2.0 * half(s.corners.map(Vec3::from))).sum()
    }
}

/// A direction whose coordinates are all clearly nonzero: along an axis, rays meet the edges of
/// boxes and grids.
fn any_direction(rng: &mut Rng) -> Vec3 {
    let mut coordinate = || {
        let x = 2.0 * rng.next_f64() - 1.0;
        x + f64::copysign(0.1, x)
    };
    vec3(coordinate(), coordinate(), coordinate())
}
