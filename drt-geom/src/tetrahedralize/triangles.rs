//! Input triangles become unions of faces of the complex.

use alloc::vec::Vec;

use super::TetrahedralizeError;
use super::complex::Complex;
use super::faces::sorted;
use super::flips::Wanted;
use super::input::{Merged, edge_key};
use super::polygon::{Rim, cut};
use super::recovery::{MOST_TRIALS, Recovery};
use crate::NONE;

/// Far more parts than any triangle needs whose surroundings are not thin as rounding.
const MOST_PARTS: usize = 10_000;

/// What is between the edges of a triangle that are all in the complex.
enum Between {
    Face,
    /// A vertex on it.
    Vertex(u32),
    /// An edge through it, of this tetrahedron.
    Edge([u32; 2], u32),
}

impl Recovery<'_> {
    pub(super) fn triangles(&mut self, merged: &Merged) -> Result<(), TetrahedralizeError> {
        for (corners, carriers) in &merged.triangles {
            let list = self.add_list(carriers);
            self.triangle(*corners, list)?;
        }
        Ok(())
    }

    fn triangle(&mut self, corners: [u32; 3], list: u32) -> Result<(), TetrahedralizeError> {
        let mut open = alloc::vec![corners];
        let mut parts = 0;
        while let Some(t) = open.pop() {
            parts += 1;
            if parts > MOST_PARTS {
                return Err(self.unrecovered(list));
            }
            let rim = self.rim(t);
            if rim.len() > 3 {
                let pieces = cut(rim, &self.complex.points);
                for [a, b] in pieces.diagonals {
                    self.segment([a, b], list)?;
                }
                open.extend(pieces.triangles);
                continue;
            }
            match self.recover_face(t, list)? {
                None => {
                    self.kept_faces.insert(sorted(t), self.lists[list as usize][0].triangle);
                }
                Some(v) => {
                    self.own(v, list);
                    for end in t {
                        self.segment([end, v], list)?;
                    }
                    let [a, b, c] = t;
                    open.extend([[a, b, v], [b, c, v], [c, a, v]]);
                }
            }
        }
        Ok(())
    }

    /// The vertices around a triangle, with those that its edges were split at.
    fn rim(&self, t: [u32; 3]) -> Vec<Rim> {
        let mut rim = Vec::with_capacity(3);
        for k in 0..3 {
            let before = (k + 2) % 3;
            rim.push(Rim { vertex: t[k], sides: 1 << k | 1 << before });
            let mut open = alloc::vec![[t[k], t[(k + 1) % 3]]];
            while let Some([a, b]) = open.pop() {
                let split = self.kept_edges.get(&edge_key(a, b)).map_or(NONE, |e| e.split);
                if split != NONE {
                    open.extend([[split, b], [a, split]]);
                } else if b != t[(k + 1) % 3] {
                    rim.push(Rim { vertex: b, sides: 1 << k });
                }
            }
        }
        rim
    }

    /// Makes a triangle a face (none), or finds or adds a vertex on it.
    fn recover_face(&mut self, t: [u32; 3], list: u32) -> Result<Option<u32>, TetrahedralizeError> {
    fn recover_face(
        &mut self,
        t: [u32; 3],
        list: u32,
    ) -> Result<Option<u32>, TetrahedralizeError> {
        let wanted = Wanted::Face(t);
        let mut trials = MOST_TRIALS;
        // Each removal but the trials leaves one edge less through it, so this ends.
        loop {
            let (edge, tet) = match self.between(t) {
                Some(Between::Face) => return Ok(None),
                Some(Between::Vertex(v)) => return Ok(Some(v)),
                Some(Between::Edge(edge, tet)) => (edge, tet),
                None => return Err(self.unrecovered(list)),
            };
            let through = self.edges_through(t, edge, tet);
            if let Some(v) = self.obstacle(t, &through, list)? {
                return Ok(Some(v));
            }
            let changed = through.iter().any(|&(e, tet)| self.remove_edge(e, tet, wanted, 1));
            if !changed && !self.shuffle(&through, wanted, &mut trials) {
                return self.divide_face(t, through, list).map(Some);
            }
        }
    }

    /// Looks from one edge of a triangle towards the third corner.
    fn between(&mut self, [u, v, w]: [u32; 3]) -> Option<Between> {
        let mut star = core::mem::take(&mut self.star);
        let start = self.complex.tet_with(u, v, &mut star);
        self.star = star;
        let ring = self.complex.ring(u, v, start?)?;
        if ring.vertices.contains(&w) {
            return Some(Between::Face);
        }
        let n = ring.tets.len();
        (0..n).find_map(|i| {
            let (r, s) = (ring.vertices[i], ring.vertices[(i + 1) % n]);
            let before = self.complex.orient([u, v, w, s]) > 0.0;
            let after = self.complex.orient([u, v, r, w]);
            match before {
                true if after == 0.0 => Some(Between::Vertex(r)),
                true if after > 0.0 => Some(Between::Edge([r, s], ring.tets[i])),
                _ => None,
            }
        })
    }

    /// All edges through a triangle, found from one, each with a tetrahedron that has it.
    fn edges_through(&self, t: [u32; 3], first: [u32; 2], tet: u32) -> Vec<([u32; 2], u32)> {
        let mut found = alloc::vec![(edge_key(first[0], first[1]), tet)];
        let mut next = 0;
        while next < found.len() {
            let ([p, q], tet) = found[next];
            next += 1;
            let Some(ring) = self.complex.ring(p, q, tet) else { continue };
            let n = ring.tets.len();
            for i in 0..n {
                let (r, s) = (ring.vertices[i], ring.vertices[(i + 1) % n]);
                for [x, y] in [[p, r], [q, r], [r, s]] {
                    let edge = edge_key(x, y);
                    if found.iter().all(|(e, _)| *e != edge) && self.complex.pierces(edge, t) {
                        found.push((edge, ring.tets[i]));
                    }
                }
            }
        }
        found
    }

    /// An edge that must stay goes through a triangle: an intersection, unless it ends there.
    fn obstacle(
        &self,
        t: [u32; 3],
        through: &[([u32; 2], u32)],
        list: u32,
    ) -> Result<Option<u32>, TetrahedralizeError> {
        for &(edge, _) in through {
            let Some(kept) = self.kept_edges.get(&edge) else { continue };
            let p = self.complex.on_triangle(t, edge);
            let end = edge.into_iter().find(|&v| self.are_near(v, p));
            return match end {
                Some(v) => Ok(Some(v)),
                None => Err(self.intersection(list, self.lists[kept.list as usize][0].triangle)),
            };
        }
        Ok(None)
    }

    /// Splits an edge through a triangle, that nearest to its middle first.
    fn divide_face(
        &mut self,
        t: [u32; 3],
        mut through: Vec<([u32; 2], u32)>,
        list: u32,
    ) -> Result<u32, TetrahedralizeError> {
        let middle = t
            .iter()
            .fold(drt_math::Vec3::ZERO, |m, &v| m + self.complex.points[v as usize] * (1.0 / 3.0));
        let middle = t.iter().fold(drt_math::Vec3::ZERO, |m, &v| {
            m + self.complex.points[v as usize] * (1.0 / 3.0)
        });
        let off = |c: &Complex, e| (c.on_triangle(t, e) - middle).length_squared();
        through.sort_by(|a, b| off(&self.complex, a.0).total_cmp(&off(&self.complex, b.0)));
        for &(edge, tet) in &through {
            let p = self.complex.on_triangle(t, edge);
            if let Some(v) = self.split_edge(edge, tet, p) {
                return Ok(v);
            }
        }
        through
            .iter()
            .find_map(|&(edge, _)| {
                let p = self.complex.on_triangle(t, edge);
                edge.into_iter().find(|&v| self.are_near(v, p))
            })
            .ok_or_else(|| self.unrecovered(list))
    }
}
