use drt_math::vec3;

use crate::{Aabb, TetMesh};

/// The order in which each of a cell's tetrahedra runs along the axes, and whether it lists its
/// vertices so.
const PATHS: [([usize; 3], bool); 6] = [
    ([0, 1, 2], true),
    ([1, 2, 0], true),
    ([2, 0, 1], true),
    ([0, 2, 1], false),
    ([1, 0, 2], false),
    ([2, 1, 0], false),
];

/// A box cut into `cells` along each axis, and each cell into the six tetrahedra around its
/// diagonal (Kuhn 1960, "Some combinatorial lemmas in topology").
///
/// Vertices come with x running fastest, and tetrahedra by cells in the same order. Faces at the
/// boundary are halves of the cells' faces.
#[must_use]
pub fn tet_grid(cells: [u32; 3], bounds: &Aabb) -> TetMesh {
    let points = cells.map(|n| n + 1);
    let extent = bounds.extent();
    let along = |i: u32, n: u32| f64::from(i) / f64::from(n);
    let mut mesh = TetMesh::default();
    each(points, |[i, j, k]| {
        let s = [along(i, cells[0]), along(j, cells[1]), along(k, cells[2])];
        let offset = vec3(extent.x * s[0], extent.y * s[1], extent.z * s[2]);
        mesh.positions.push(bounds.min + offset);
    });
    let strides = [1, points[0], points[0] * points[1]];
    each(cells, |cell| {
        let first: u32 = (0..3).map(|axis| cell[axis] * strides[axis]).sum();
        for (path, forward) in PATHS {
            let a = first + strides[path[0]];
            let b = a + strides[path[1]];
            let c = b + strides[path[2]];
            mesh.tets.push(if forward { [first, a, b, c] } else { [first, a, c, b] });
        }
    });
    mesh
}

/// Calls `f` with all triples below `counts`, the first number running fastest.
fn each(counts: [u32; 3], mut f: impl FnMut([u32; 3])) {
    for k in 0..counts[2] {
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                f([i, j, k]);
            }
        }
    }
}
