//! Tetrahedra around and inside triangle surfaces.
//!
//! The Delaunay tetrahedra of all vertices come first (Bowyer 1981, Watson 1981, on the predicates of
//! Shewchuk 1997). Most edges and triangles of the surfaces are among theirs; missing ones are
//! recovered by changes of connectivity, as Si 2015, "TetGen, a Delaunay-based quality tetrahedral
//! mesh generator", does, and where these get stuck by adding a vertex where the edge or triangle
//! meets what is in its way. All edges come before all triangles.

use alloc::vec::Vec;

use drt_math::Vec3;

use crate::{Mesh, TetMesh, TetVertexOrigin};

mod complex;
mod delaunay;
mod faces;
mod flips;
mod input;
mod origins;
mod plate;
mod predicates;
mod recovery;
mod segments;
mod slivers;
mod triangles;
mod walk;

use delaunay::delaunay;
use input::Merged;
use recovery::Recovery;

/// What to fill with tetrahedra.
#[derive(Clone, Copy, Debug)]
pub struct TetrahedralizeInput<'a> {
    /// Open or closed surfaces. They may touch and lie on one another, not pass through one another.
    pub surfaces: &'a [&'a Mesh],
    /// Further points to be vertices: cameras, point lights.
    pub points: &'a [Vec3],
    /// The enclosing box is the bounds of all this, grown on each side by this fraction of their
    /// diagonal.
    pub margin: f64,
}

/// A box full of tetrahedra, in which every surface triangle is a union of faces.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tetrahedralization {
    /// The tetrahedra; all have positive volume, by exact arithmetic on the coordinates.
    pub mesh: TetMesh,
    /// Where each vertex lies on the input.
    pub origins: Vec<TetVertexOrigin>,
    /// Further places of the input at the same vertex: where surfaces touch, and where a surface
    /// has several vertices at one position. Sorted by vertex.
    pub shared: Vec<(u32, TetVertexOrigin)>,
}

/// A triangle of one of several surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SurfaceTriangle {
    /// Index of the surface in the input.
    pub surface: u32,
    /// Index of the triangle in the surface.
    pub triangle: u32,
}

/// Why space could not be filled.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TetrahedralizeError {
    /// A coordinate is NaN or infinite.
    #[error(
        "surface {surface} (from 0): vertex {vertex} has a coordinate that is not a finite number"
    )]
    NonFinitePosition {
        /// Which surface.
        surface: usize,
        /// Which of its vertices.
        vertex: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("surface {surface} (from 0): triangle {triangle} names a vertex that does not exist")]
    IndexOutOfRange {
        /// Which surface.
        surface: usize,
        /// Which of its triangles.
        triangle: usize,
    },
    /// A coordinate of a point is NaN or infinite.
    #[error("point {point} (from 0) has a coordinate that is not a finite number")]
    NonFinitePoint {
        /// Which point.
        point: usize,
    },
    /// The margin is not a positive number.
    #[error("the box's margin is {margin}; it must be positive and finite")]
    BadMargin {
        /// The margin given.
        margin: f64,
    },
    /// More vertices than 32-bit indices can name.
    #[error("{count} vertices are too many")]
    TooLarge {
        /// How many there are.
        count: usize,
    },
    /// Two triangles pass through each other.
    #[error("{first} and {second} intersect; separate them or join the surfaces where they meet")]
    Intersection {
        /// One of the triangles.
        first: SurfaceTriangle,
        /// The other.
        second: SurfaceTriangle,
    },
    /// A triangle could not be made a union of faces: something is as near to it as coordinates
    /// are rounded.
    #[error("{triangle} is too thin, or too near to others, for the precision of its coordinates")]
    Unrecovered {
        /// Which triangle.
        triangle: SurfaceTriangle,
    },
    /// The signs of determinants contradict each other: coordinates differ by more than 1e50 or so.
    #[error("the coordinates are too different in size: their determinants underflow")]
    Arithmetic,
}

impl core::fmt::Display for SurfaceTriangle {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "triangle {} of surface {} (from 0)", self.triangle, self.surface)
    }
}

/// Fills a box around surfaces with tetrahedra that respect them: every triangle of the surfaces is
/// a union of faces, some with added vertices on its edges or inside.
///
/// Triangles without area are skipped. Vertices that belong to no other triangle do not appear.
///
/// # Errors
/// See [`TetrahedralizeError`]; above all when surfaces pass through each other.
pub fn tetrahedralize(
    input: &TetrahedralizeInput<'_>,
) -> Result<Tetrahedralization, TetrahedralizeError> {
    let merged = Merged::new(input)?;
    let bounds = merged.enclosing_box(input.margin);
    let complex = delaunay(&bounds, &merged.positions).ok_or(TetrahedralizeError::Arithmetic)?;
    let mut recovery = Recovery::new(complex, &merged);
    recovery.edges(&merged)?;
    recovery.triangles(&merged)?;
    Ok(recovery.finish(&merged))
}
