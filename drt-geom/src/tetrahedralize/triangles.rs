//! Input triangles become unions of faces of the complex.

use alloc::vec::Vec;

use super::TetrahedralizeError;
use super::complex::OPPOSITE;
use super::faces::sorted;
use super::flips::Wanted;
use super::input::{Merged, edge_key};
use super::plate::Plate;
use super::recovery::{Kept, Recovery};
use crate::NONE;

/// Far more vertices on a triangle than are ever added but where all around is thin as rounding.
const MOST_VERTICES: usize = 10_000;

impl Recovery<'_> {
    pub(super) fn triangles(&mut self, merged: &Merged) -> Result<(), TetrahedralizeError> {
        for (corners, carriers) in &merged.triangles {
            let rim = self.rim(*corners);
            if rim.len() == 3 && self.has_face(*corners) {
                self.kept_faces.insert(sorted(*corners), carriers[0].triangle);
            } else {
                let list = self.add_list(carriers);
                self.triangle(Plate::new(&self.complex, *corners, rim), list)?;
            }
        }
        Ok(())
    }

    fn has_face(&mut self, [u, v, w]: [u32; 3]) -> bool {
        let mut star = core::mem::take(&mut self.star);
        self.complex.star(u, &mut star);
        let found = star.iter().any(|&t| {
            let tet = &self.complex.tets[t as usize];
            tet.has(v) && tet.has(w)
        });
        self.star = star;
        found
    }

    /// The vertices around a triangle, those included that its edges were split at, each with the
    /// sides it lies on, one bit each.
    fn rim(&self, t: [u32; 3]) -> Vec<(u32, u8)> {
        let mut rim = Vec::with_capacity(3);
        for k in 0..3 {
            let end = t[(k + 1) % 3];
            rim.push((t[k], 1 << k | 1 << ((k + 2) % 3)));
            let mut open = alloc::vec![[t[k], end]];
            while let Some([a, b]) = open.pop() {
                let split = self.kept_edges.get(&edge_key(a, b)).map_or(NONE, |e| e.split);
                if split != NONE {
                    open.extend([[split, b], [a, split]]);
                } else if b != end {
                    rim.push((b, 1 << k));
                }
            }
        }
        rim
    }

    /// Clears a triangle, whose edges are there, of what passes through it.
    ///
    /// Once every edge through it is removed or split, it is a union of faces: none of the edges
    /// that come of a split passes through it again. Vertices on it count as exactly on it.
    fn triangle(&mut self, mut plate: Plate, list: u32) -> Result<(), TetrahedralizeError> {
        let mut trials = self.allowance();
        loop {
            let through = self.through(&mut plate);
            if through.is_empty() {
                break;
            }
            if plate.vertices().len() > MOST_VERTICES {
                return Err(self.unrecovered(list));
            }
            let kept = through.iter().find_map(|(e, _)| self.kept_edges.get(e));
            if let Some(kept) = kept {
                let other = self.lists[kept.list as usize][0].triangle;
                return Err(self.intersection(list, other));
            }
            let wanted = Wanted::Face(&plate);
            let mut changed = false;
            for &(edge, _) in &through {
                changed |= self.remove_if_there(edge, wanted);
            }
            if changed || self.shuffle(&through, wanted, &mut trials) {
                continue;
            }
            for &([p, q], _) in &through {
                let Some(tet) = self.tet_with([p, q]) else { continue };
                let at = plate.crossing(&self.complex, [p, q]);
                let v = self.split_edge([p, q], tet, at).ok_or_else(|| self.unrecovered(list))?;
                plate.add(v);
            }
        }
        for v in plate.added() {
            self.own(v, list);
        }
        self.keep_faces(&plate, list)
    }

    fn remove_if_there(&mut self, edge: [u32; 2], wanted: Wanted<'_>) -> bool {
        self.tet_with(edge).is_some_and(|tet| self.remove_edge(edge, tet, wanted, 1))
    }

    fn tet_with(&mut self, [p, q]: [u32; 2]) -> Option<u32> {
        let mut star = core::mem::take(&mut self.star);
        let tet = self.complex.tet_with(p, q, &mut star);
        self.star = star;
        tet
    }

    /// All edges through a triangle, each with a tetrahedron that has it. Vertices met on the way
    /// that are on the triangle join it.
    fn through(&mut self, plate: &mut Plate) -> Vec<([u32; 2], u32)> {
        let mut found: Vec<([u32; 2], u32)> = Vec::new();
        let (mut next_vertex, mut next_edge) = (0, 0);
        let mut star = Vec::new();
        loop {
            // What a tetrahedron shares with the triangle has a vertex on it or an edge through it.
            if let Some(&v) = plate.vertices().get(next_vertex) {
                next_vertex += 1;
                self.complex.star(v, &mut star);
            } else if let Some(&([p, q], tet)) = found.get(next_edge) {
                next_edge += 1;
                star.clear();
                star.extend(self.complex.ring(p, q, tet).into_iter().flat_map(|r| r.tets));
            } else {
                break;
            }
            for &t in &star {
                let v = self.complex.tets[t as usize].vertices;
                for w in v {
                    plate.join(&self.complex, w);
                }
                for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                    let edge = edge_key(v[i], v[j]);
                    if plate.is_pierced_by(&self.complex, edge)
                        && found.iter().all(|(e, _)| *e != edge)
                    {
                        found.push((edge, t));
                    }
                }
            }
        }
        // Some were found before one of their ends joined.
        found.retain(|(e, _)| plate.is_pierced_by(&self.complex, *e));
        found
    }

    /// The faces between the vertices on a triangle must stay, and so must their edges.
    fn keep_faces(&mut self, plate: &Plate, list: u32) -> Result<(), TetrahedralizeError> {
        let triangle = self.lists[list as usize][0].triangle;
        let mut star = Vec::new();
        let mut area = 0.0;
        for &v in plate.vertices() {
            self.complex.star(v, &mut star);
            for &t in &star {
                let tet = self.complex.tets[t as usize];
                for (corner, face) in OPPOSITE.iter().enumerate() {
                    let face = face.map(|k| tet.vertices[k]);
                    if !face.contains(&v) || !plate.has_face(face) {
                        continue;
                    }
                    if !plate.has(tet.vertices[corner]) {
                        // Once for each of its vertices, and from either side.
                        area += plate.area(&self.complex, face) / 6.0;
                    }
                    self.kept_faces.insert(sorted(face), triangle);
                    for k in 0..3 {
                        let edge = edge_key(face[k], face[(k + 1) % 3]);
                        self.kept_edges.entry(edge).or_insert(Kept { list, split: NONE });
                    }
                }
            }
        }
        if plate.is_covered_by(area) { Ok(()) } else { Err(self.unrecovered(list)) }
    }
}
