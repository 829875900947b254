//! Shapes made by formula, for tests and scenes.
//!
//! Closed shapes have outward normals; flat ones lie in z = 0 with normal +z. Resolutions below the
//! least that makes sense are raised to it.

use alloc::vec::Vec;

use drt_math::{Vec3, fm};

use crate::Mesh;

mod cylinder;
mod flat;
mod knot;
mod solid;
mod sphere;
mod tet_grid;
mod tree;
mod tube;

pub use cylinder::cylinder;
pub use flat::{disk, grid, rectangle, star};
pub use knot::{TorusKnot, torus_knot};
pub use solid::cube;
pub use sphere::{bumpy_sphere, icosphere, uv_sphere};
pub use tet_grid::tet_grid;
pub use tree::{BranchingTree, branching_tree};

/// A mesh whose arrays are right by construction.
fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let source_vertex_count = positions.len() as u32;
    Mesh { positions, triangles, source_vertex_count, ..Mesh::default() }
}

/// Cosine and sine of the `i`-th of `n` equal parts of the full turn.
fn on_circle(i: u32, n: u32) -> (f64, f64) {
    let (s, c) = fm::sin_cos(core::f64::consts::TAU * f64::from(i) / f64::from(n));
    (c, s)
}

/// Both triangles of a quad whose corners run counter-clockwise, cut from its first corner.
fn quad([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}
