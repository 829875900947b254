use drt_math::vec3;

use super::{mesh, quad};
use crate::Mesh;

/// The cube [-1, 1]³ of 8 vertices and 12 triangles: Mitsuba's `cube`.
#[must_use]
pub fn cube() -> Mesh {
    let side = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let positions = (0..8).map(|i| vec3(side(i, 0), side(i, 1), side(i, 2))).collect();
    let faces =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    mesh(positions, faces.into_iter().flat_map(quad).collect())
}
