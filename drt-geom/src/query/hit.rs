use drt_math::Vec3;

use crate::NONE;

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Hit {
    /// Ray parameter, in units of the ray's direction.
    pub t: f64,
    /// Index of the triangle in the soup the tree was built over.
    pub prim: u32,
    /// Weights of the triangle's vertices 1 and 2; vertex 0 has the rest.
    pub bary: [f64; 2],
}

impl Hit {
    /// The point hit, interpolated from the corners of the triangle.
    ///
    /// This point lies on the triangle up to a rounding error bounded by the size of its
    /// coordinates alone; `ray.at(hit.t)` carries an error that grows with the distance travelled.
    /// New rays should start here.
    #[inline]
    #[must_use]
    pub fn point(&self, [a, b, c]: [Vec3; 3]) -> Vec3 {
        let [u, v] = self.bary;
        a * (1.0 - u - v) + b * u + c * v
    }

    /// The order of hits along a ray.
    #[inline]
    pub(super) fn is_before(&self, other: &Self) -> bool {
        (self.t, self.prim) < (other.t, other.prim)
    }
}

/// Up to two triangles that a query passes over: those the ray starts or ends on.
///
/// The default skips nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Skip(
    /// The triangles; [`NONE`] stands for no triangle, so that [`Edge::faces`](crate::Edge::faces)
    /// fits as it is.
    pub [u32; 2],
);

impl Skip {
    /// Passes over nothing.
    pub const NOTHING: Self = Self([NONE, NONE]);

    /// Passes over one triangle.
    #[must_use]
    pub const fn one(prim: u32) -> Self {
        Self([prim, NONE])
    }
    /// Passes over two triangles: those at a segment's ends, or on both sides of an edge.
    #[must_use]
    pub const fn two(a: u32, b: u32) -> Self {
        Self([a, b])
    }
    /// Whether the query passes over this triangle.
    #[inline]
    #[must_use]
    pub const fn contains(self, prim: u32) -> bool {
        self.0[0] == prim || self.0[1] == prim
    }
}

impl Default for Skip {
    fn default() -> Self {
        Self::NOTHING
    }
}
