//! Signs that are exact for the given coordinates: Shewchuk 1997, "Adaptive precision floating-point
//! arithmetic and fast robust geometric predicates".

use drt_math::Vec3;
use robust::{Coord, Coord3D};

fn coord(p: Vec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// `(b - a) × (c - a) · (d - a)`: its sign is exact, its size good to a few digits at least.
#[inline]
pub(super) fn orient([a, b, c, d]: [Vec3; 4]) -> f64 {
    -robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Positive when `e` is strictly inside the sphere through the corners of a positive tetrahedron,
/// zero when on it.
#[inline]
pub(super) fn in_sphere([a, b, c, d]: [Vec3; 4], e: Vec3) -> f64 {
    robust::insphere(coord(b), coord(a), coord(c), coord(d), coord(e))
}

/// Twice the signed area of a triangle's projection along each axis.
pub(super) fn projected_areas([a, b, c]: [Vec3; 3]) -> [f64; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        let flat = |p: Vec3| Coord { x: p[i], y: p[j] };
        robust::orient2d(flat(a), flat(b), flat(c))
    })
}
