//! Directions and areas, and how these change with what they are made of.

use drt_math::Vec3;

/// A vector divided by its length, and that length's reciprocal; both zero for the zero vector, so
/// that the rate of a direction that does not exist is zero rather than NaN.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unit {
    pub(crate) dir: Vec3,
    pub(crate) inv_length: f64,
}

impl Unit {
    #[inline]
    pub(crate) fn new(v: Vec3) -> Self {
        let length = v.length();
        let inv_length = if length > 0.0 { 1.0 / length } else { 0.0 };
        Self { dir: v * inv_length, inv_length }
    }

    /// Derivative of the normalisation along `v_dot`; the map is symmetric, hence its own
    /// transpose.
    #[inline]
    pub(crate) fn rate(&self, v_dot: Vec3) -> Vec3 {
        v_dot.reject(self.dir) * self.inv_length
    }
}

/// Edges from the first corner, and their cross product: twice the area along the normal.
#[inline]
pub(crate) fn edges_and_area([a, b, c]: [Vec3; 3]) -> ([Vec3; 2], Vec3) {
    let (e1, e2) = (b - a, c - a);
    ([e1, e2], e1.cross(e2))
}

/// Rate of e1 × e2 for moving corners.
#[inline]
pub(crate) fn area_rate([e1, e2]: [Vec3; 2], [a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(e2) + e1.cross(c - a)
}

/// Transpose of [`area_rate`]: gradients with respect to the corners' velocities.
#[inline]
pub(crate) fn area_rate_transposed([e1, e2]: [Vec3; 2], g: Vec3) -> [Vec3; 3] {
    let (b, c) = (e2.cross(g), g.cross(e1));
    [-(b + c), b, c]
}
