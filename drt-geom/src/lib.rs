#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
// Only query::lanes has any: vector instructions that are there when the running program finds them.
#![deny(unsafe_code)]

extern crate alloc;

mod aabb;
mod crossing;
pub mod edges;
mod intersect;
#[cfg(any(feature = "obj", feature = "ply", feature = "tet"))]
mod io;
mod mesh;
pub mod procedural;
mod query;
mod tet;
#[cfg(feature = "tetgen")]
mod tetgen;
mod tetrahedralize;
mod topology;
#[cfg(feature = "spade")]
mod triangulate;
mod weld;

// What the public interface is made of, so that one dependency is enough.
pub use drt_math;

pub use drt_math::Ray;

pub use aabb::Aabb;
pub use crossing::{CrossingSegment, crossing_pairs, crossing_segments};
pub use intersect::ray_plane;
#[cfg(feature = "obj")]
pub use io::{ObjError, ObjErrorKind, decode_obj, decode_obj_mended, read_obj};
#[cfg(feature = "ply")]
pub use io::{
    PlyError, PlyErrorKind, decode_ply, decode_ply_mended, decode_vertex_vectors, read_ply,
};
#[cfg(feature = "tet")]
pub use io::{TetFileError, TetFileErrorKind, decode_medit, decode_tetgen, read_tet_mesh};
pub use mesh::{Mesh, MeshAttribute, MeshError};
pub use query::{
    AlongSegment, BvhBuilder, BvhError, ClosestPoint, Hit, InstancePlacement, InstancedBvh, Skip,
    TriangleBvh, coincide, nearest_point,
};
pub use tet::{
    ConformityError, SurfacePlace, TetLocator, TetMesh, TetMeshError, TetPoint, TetVertexOrigin,
    tet_barycentric,
};
#[cfg(feature = "tetgen")]
pub use tetgen::{TetgenError, tetrahedralize_tetgen};
/// The library's own errors, which [`TetgenError`] holds.
#[cfg(feature = "tetgen")]
pub use tetgen_sys;
pub use tetrahedralize::{
    SurfaceTriangle, Tetrahedralization, TetrahedralizeError, TetrahedralizeInput, tetrahedralize,
};
pub use topology::{Edge, EdgeClass, Topology};
#[cfg(feature = "spade")]
pub use triangulate::{PolygonError, newell_normal, triangulate};
pub use weld::weld;

/// The index that stands for "none" where a face or primitive may be absent.
pub const NONE: u32 = u32::MAX;

/// Largest coordinate a scene may have: products of three stay in the range of `f64`.
const LARGEST: f64 = 1e100;

/// Whether a point can be computed with.
fn is_usable(p: drt_math::Vec3) -> bool {
    p.is_finite() && p.max_abs() <= LARGEST
}
