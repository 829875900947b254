//! Tetrahedra around and inside triangle surfaces.

use alloc::vec::Vec;

use drt_math::Vec3;

use crate::{Mesh, TetMesh, TetVertexOrigin};

mod predicates;

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
    #[error("surface {surface} (from 0): vertex {vertex} has a coordinate that is not a finite number")]
    NonFinitePosition {
        /// Which surface.
        surface: usize,
        /// Which of its vertices.
        vertex: usize,
    },
}

/// Fills a box around surfaces with tetrahedra that respect them.
///
/// # Errors
/// See [`TetrahedralizeError`].
pub fn tetrahedralize(
    _input: &TetrahedralizeInput<'_>,
) -> Result<Tetrahedralization, TetrahedralizeError> {
    Ok(Tetrahedralization::default())
}
