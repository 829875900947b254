//! Changes of connectivity that add no vertex: a face makes way for an edge, an edge for faces.

use alloc::vec::Vec;

use super::complex::{Complex, ROUNDING};
use super::plate::Plate;
use crate::NONE;

/// Rings longer than this are left alone: removing their edge is the cube of it in work.
const LONGEST_RING: usize = 20;

/// What edges and faces are in the way of.
#[derive(Clone, Copy, Debug)]
pub(super) enum Wanted<'a> {
    /// An edge; faces that it pierces are in its way.
    Edge([u32; 2]),
    /// A face whose edges are there; edges through it are in its way.
    Face(&'a Plate),
}

impl Wanted<'_> {
    fn blocked_by_edge(self, c: &Complex, edge: [u32; 2]) -> u32 {
        match self {
            Self::Edge(_) => 0,
            Self::Face(plate) => plate.is_pierced_by(c, edge).into(),
        }
    }

    fn blocked_by_face(self, c: &Complex, face: [u32; 3]) -> u32 {
        match self {
            Self::Edge(edge) => c.pierces(edge, face).into(),
            Self::Face(_) => 0,
        }
    }
}

impl Complex {
    /// Whether a tetrahedron is positive and none of its corners as near to the face across as
    /// rounding is: vertices to come could not be placed there.
    pub(super) fn is_thick(&self, t: [u32; 4]) -> bool {
        let [a, b, c, d] = t.map(|v| self.points[v as usize]);
        let size = [b - a, c - a, d - a].iter().fold(0.0, |m, e| f64::max(m, e.max_abs()));
        self.orient(t) > ROUNDING * size * size
    }

    /// Replaces the two tetrahedra at a face by three around the edge between the vertices across
    /// from it (the 2-3 flip), where these are positive and what is in the way becomes less by at
    /// least `gain`.
    pub(super) fn remove_face(
        &mut self,
        tet: u32,
        corner: usize,
        wanted: Wanted<'_>,
        gain: u32,
    ) -> bool {
        let below = self.tets[tet as usize];
        let other = below.neighbors[corner];
        if other == NONE {
            return false;
        }
        let face = below.face(corner);
        let p = below.vertices[corner];
        let above = self.tets[other as usize].vertices;
        let Some(q) = above.into_iter().find(|v| !face.contains(v)) else { return false };
        // Counter-clockwise seen from outside the lower one is so from above: around p → q.
        let [x, y, z] = face;
        let made = [[p, q, x, y], [p, q, y, z], [p, q, z, x]];
        if !made.iter().all(|&t| self.is_thick(t)) {
            return false;
        }
        let new = wanted.blocked_by_edge(self, [p, q])
            + face.iter().map(|&v| wanted.blocked_by_face(self, [p, q, v])).sum::<u32>();
        let possible = new + gain <= wanted.blocked_by_face(self, face);
        if possible {
            self.replace(&[tet, other], &made);
        }
        possible
    }

    /// Removes an edge by filling its ring with triangles, each the base of a tetrahedron to
    /// either end of the edge, where that leaves less in the way by at least `gain`.
    ///
    /// The filling that leaves least is found by dynamic programming: Klincsek 1980; for tetrahedra
    /// Shewchuk 2002, "Two discrete optimization algorithms for the topological improvement of
    /// tetrahedral meshes".
    pub(super) fn remove_edge(
        &mut self,
        [p, q]: [u32; 2],
        tet: u32,
        wanted: Wanted<'_>,
        gain: u32,
    ) -> bool {
        let Some(ring) = self.ring(p, q, tet) else { return false };
        let r = &ring.vertices;
        let n = r.len();
        let faces = r.iter().map(|&v| wanted.blocked_by_face(self, [p, q, v]));
        let now = wanted.blocked_by_edge(self, [p, q]) + faces.sum::<u32>();
        if n > LONGEST_RING || now < gain {
            return false;
        }
        // Of the part of the ring from i to j: the least in the way, and the third vertex of the
        // triangle on the diagonal.
        let mut best = alloc::vec![(0_u32, 0_usize); n * n];
        for (i, j) in (2..n).flat_map(|span| (0..n - span).map(move |i| (i, i + span))) {
            let of_diagonal = if j - i == n - 1 {
                0
            } else {
                wanted.blocked_by_edge(self, [r[i], r[j]])
                    + wanted.blocked_by_face(self, [p, r[i], r[j]])
                    + wanted.blocked_by_face(self, [q, r[i], r[j]])
            };
            let mut least = (u32::MAX, 0);
            for k in i + 1..j {
                let parts = best[i * n + k].0.saturating_add(best[k * n + j].0);
                let bound = parts.saturating_add(of_diagonal);
                let [a, b, c] = [r[i], r[k], r[j]];
                if bound < least.0
                    && bound.saturating_add(gain) <= now
                    && self.is_thick([a, b, c, q])
                    && self.is_thick([a, c, b, p])
                {
                    least = least.min((bound + wanted.blocked_by_face(self, [a, b, c]), k));
                }
            }
            best[i * n + j] = least;
        }
        if best[n - 1].0.saturating_add(gain) > now {
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
