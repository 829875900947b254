//! Changes of connectivity that add no vertex: a face makes way for an edge, an edge for faces.

use alloc::vec::Vec;

use super::complex::{Complex, Ring};
use crate::NONE;

/// Rings longer than this are left alone: removing their edge is the cube of it in work.
const LONGEST_RING: usize = 20;

impl Complex {
    /// Replaces the two tetrahedra at a face by three around the edge between the vertices across
    /// from it (the 2-3 flip), where these are positive and `allowed` takes each new face.
    pub(super) fn face_to_edge(
        &mut self,
        tet: u32,
        corner: usize,
        allowed: impl Fn(&Self, [u32; 3]) -> bool,
    ) -> bool {
        let below = self.tets[tet as usize];
        let other = below.neighbors[corner];
        if other == NONE {
            return false;
        }
        let above = &self.tets[other as usize];
        let [x, y, z] = below.face(corner);
        let p = below.vertices[corner];
        let Some(q) = above.vertices.into_iter().find(|v| ![x, y, z].contains(v)) else {
            return false;
        };
        // Counter-clockwise seen from outside the lower one is from above: around p → q.
        let made = [[p, q, x, y], [p, q, y, z], [p, q, z, x]];
        let possible = made.iter().all(|&t| self.orient(t) > 0.0)
            && [x, y, z].iter().all(|&v| allowed(self, [p, q, v]));
        if possible {
            self.replace(&[tet, other], &made);
        }
        possible
    }

    /// Removes an edge by filling its ring with triangles, each the base of a tetrahedron to
    /// either end of the edge, at the least total `cost`, which must be less than `below`.
    ///
    /// `cost` is that of a diagonal of the ring and, separately, of a triangle. The best
    /// filling is found by dynamic programming: Klincsek 1980; for tetrahedra Shewchuk 2002, "Two
    /// discrete optimization algorithms for the topological improvement of tetrahedral meshes".
    pub(super) fn remove_edge(
        &mut self,
        [p, q]: [u32; 2],
        ring: &Ring,
        below: u32,
        diagonal_cost: impl Fn(&Self, [u32; 2]) -> u32,
        triangle_cost: impl Fn(&Self, [u32; 3]) -> u32,
    ) -> bool {
        let r = &ring.vertices;
        let n = r.len();
        if n > LONGEST_RING || below == 0 {
            return false;
        }
        // Of the part of the ring from i to j: the least cost, and the third vertex of the triangle
        // on the diagonal.
        let mut best = alloc::vec![(0_u32, 0_usize); n * n];
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                let closing = i == 0 && j == n - 1;
                let of_diagonal = if closing { 0 } else { diagonal_cost(self, [r[i], r[j]]) };
                let mut least = (u32::MAX, 0);
                for k in i + 1..j {
                    let parts = best[i * n + k].0.saturating_add(best[k * n + j].0);
                    let bound = parts.saturating_add(of_diagonal);
                    if bound >= u32::min(least.0, below) {
                        continue;
                    }
                    let [a, b, c] = [r[i], r[k], r[j]];
                    let positive =
                        self.orient([a, b, c, q]) > 0.0 && self.orient([a, c, b, p]) > 0.0;
                    if positive {
                        let total = bound.saturating_add(triangle_cost(self, [a, b, c]));
                        least = least.min((total, k));
                    }
                }
                best[i * n + j] = least;
            }
        }
        if best[n - 1].0 >= below {
            return false;
        }
        let mut made = Vec::with_capacity(2 * n);
        let mut parts = alloc::vec![(0, n - 1)];
        while let Some((i, j)) = parts.pop() {
            if j - i >= 2 {
                let k = best[i * n + j].1;
                made.push([r[i], r[k], r[j], q]);
                made.push([r[i], r[j], r[k], p]);
                parts.extend([(i, k), (k, j)]);
            }
        }
        self.replace(&ring.tets, &made);
        true
    }
}
