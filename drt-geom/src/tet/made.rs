use alloc::vec::Vec;

use drt_math::Vec3;

use super::{TetMesh, TetVertexOrigin};
use crate::Mesh;

/// What a tetrahedral mesh is to be made of.
#[derive(Clone, Copy, Debug)]
pub struct TetrahedralizeInput<'a> {
    /// Surfaces that are to become faces of the tetrahedra, open or closed. They may meet in common
    /// edges and corners only, which are those of equal positions.
    pub surfaces: &'a [&'a Mesh],
    /// Points that are to become vertices, off the surfaces.
    pub points: &'a [Vec3],
    /// How far the enclosing box reaches beyond the bounds of all that on every side, in units of
    /// their diagonal.
    pub margin: f64,
}

/// A box filled with tetrahedra, and where their vertices came from.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tetrahedralization {
    /// The tetrahedra.
    pub mesh: TetMesh,
    /// Where each vertex comes from; the first, in the order of the input, where it has several origins.
    pub origins: Vec<TetVertexOrigin>,
    /// The further origins of vertices at which several vertices of the input coincide: corners
    /// where surfaces touch, copies of a vertex within one. Sorted by vertex.
    pub shared: Vec<(u32, TetVertexOrigin)>,
}
