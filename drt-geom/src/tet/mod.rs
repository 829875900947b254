//! Tetrahedral meshes of a domain of space.

use alloc::vec::Vec;

use drt_math::{Real, Vec3};

use crate::Aabb;

mod arrays;
mod conformity;
mod double;
mod error;
mod faces;
mod locate;
mod overlap;
mod starts;
mod validate;

pub use conformity::{ConformityError, SurfacePlace};
pub use error::TetMeshError;
pub use locate::{TetLocator, TetPoint};

use double::EdgeFrame;

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

impl TetMesh {
    /// The corners of a tetrahedron, whose indices must be valid.
    #[inline]
    #[must_use]
    pub fn tet(&self, i: u32) -> [Vec3; 4] {
        self.tets[i as usize].map(|v| self.positions[v as usize])
    }

    /// Signed volume of a tetrahedron, positive for one that lists its vertices as it should. The
    /// sign is right also where the volume is next to nothing.
    #[must_use]
    pub fn volume(&self, i: u32) -> f64 {
        EdgeFrame::of(self.tet(i)).volume()
    }

    /// The smallest box around all positions.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.positions.iter().copied())
    }

    /// Swaps two vertices of every tetrahedron that is inverted, as all are in files with another
    /// convention, and returns how many there were. The indices must be valid.
    ///
    /// Those that are flat to the rounding of the coordinates are swapped if most others are, so that
    /// they keep fitting their neighbours.
    pub fn orient(&mut self) -> usize {
        let reach = flat_height(&self.positions);
        let count = self.tets.len() as u32;
        let frames = (0..count).map(|i| (i, EdgeFrame::of(self.tet(i))));
        let (flat, thick): (Vec<_>, Vec<_>) = frames.partition(|(_, f)| f.is_flat(reach));
        let numbers = |frames: Vec<(u32, EdgeFrame)>| frames.into_iter().map(|(i, _)| i);
        let total = thick.len();
        let inverted: Vec<_> = thick.into_iter().filter(|(_, f)| f.determinant() < 0.0).collect();
        let most = 2 * inverted.len() > total;
        let swapped = numbers(inverted).chain(numbers(if most { flat } else { Vec::new() }));
        swapped.map(|i| self.tets[i as usize].swap(2, 3)).count()
    }
}

/// The height up to which the rounding of coordinates may have made, or inverted, a tetrahedron.
fn flat_height(positions: &[Vec3]) -> f64 {
    4.0 * f64::EPSILON * positions.iter().fold(0.0, |m, p| f64::max(m, p.max_abs()))
}

/// Weights that make the point `x` of a tetrahedron's corners: they sum to one, and all are
/// positive inside. Not finite for a tetrahedron without volume.
#[must_use]
pub fn tet_barycentric<T: Real>([a, b, c, d]: [Vec3<T>; 4], x: Vec3<T>) -> [T; 4] {
    let (e1, e2, e3, p) = (b - a, c - a, d - a, x - a);
    let n1 = e2.cross(e3);
    let per_volume = e1.dot(n1).recip();
    let w1 = p.dot(n1) * per_volume;
    let w2 = p.dot(e3.cross(e1)) * per_volume;
    let w3 = p.dot(e1.cross(e2)) * per_volume;
    [T::one() - w1 - w2 - w3, w1, w2, w3]
}
