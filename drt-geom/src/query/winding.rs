use core::ops::ControlFlow;

use drt_math::{Ray, Vec3, vec3};

use super::{Skip, TriangleBvh};

/// Any direction does; one askew of the axes meets fewer of the edges of boxes and grids.
const DIRECTION: Vec3 = vec3(0.297, 0.539, 0.788);

impl TriangleBvh {
    /// How often the surface winds around `p`: for a closed mesh with outward normals 1 inside and
    /// 0 outside; more where closed parts overlap, negative where they are inside out.
    ///
    /// Counts signed crossings along a ray, which is exact also through edges and vertices.
    /// Meaningless for a `p` on the surface and for open meshes.
    #[must_use]
    pub fn winding_number(&self, p: impl Into<Vec3>) -> i32 {
        self.winding(p.into())
    }

    fn winding(&self, p: Vec3) -> i32 {
        let mut sum = 0;
        self.visit(&Ray::new(p, DIRECTION), Skip::NOTHING, None, |_, _, crossing, _| {
            sum += if crossing.det < 0.0 { 1 } else { -1 };
            ControlFlow::Continue(f32::INFINITY)
        });
        sum
    }

    /// Whether `p` is inside: the surface winds around it.
    #[must_use]
    pub fn inside(&self, p: impl Into<Vec3>) -> bool {
        self.winding(p.into()) != 0
    }
}
