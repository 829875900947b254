//! All tests of the crate from outside, in one program.

mod brute_force;
#[cfg(feature = "obvhs")]
mod builders;
mod common;
mod crossing;
mod instanced;
mod intersect;
mod mesh;
mod nearest;
#[cfg(feature = "obj")]
mod obj;
mod own_surface;
#[cfg(feature = "ply")]
mod ply;
mod procedural;
mod slivers;
#[cfg(feature = "tet")]
mod tet_files;
mod tet_locate;
mod tet_mesh;
#[cfg(feature = "tetgen")]
mod tetgen;
mod tetrahedralize;
mod topology;
#[cfg(feature = "spade")]
mod triangulate;
mod watertight;
