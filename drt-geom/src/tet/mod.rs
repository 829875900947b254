//! Tetrahedral meshes of a domain of space.

use alloc::vec::Vec;

use drt_math::Vec3;

/// Tetrahedra that share vertices.
///
/// Each lists its vertices so that the last is seen from the first three on the side from which
/// they run clockwise: `(b - a) × (c - a) · (d - a) > 0`.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TetMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex indices of each tetrahedron.
    pub tets: Vec<[u32; 4]>,
}

/// Where a vertex of a tetrahedral mesh lies on the input it was made from; velocities follow.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TetVertexOrigin {
    /// A point of a surface: the material point of a triangle, corners included.
    Surface {
        /// Index of the surface in the input.
        surface: u32,
        /// Index of the triangle in the surface.
        triangle: u32,
        /// Barycentric weights of the triangle's second and third corner; the first has the rest.
        bary: [f64; 2],
    },
    /// A point of the input that lies on no surface, by its index.
    Point(u32),
    /// A corner of the enclosing box.
    Box,
    /// Somewhere between: it was added for the mesh's sake.
    Inside,
}
