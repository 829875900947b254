//! Input edges become chains of edges of the complex.

use alloc::vec::Vec;

use super::TetrahedralizeError;
use super::complex::Complex;
use super::faces::sorted;
use super::input::{Merged, edge_key};
use super::recovery::{Kept, Recovery};
use super::walk::Meets;
use crate::NONE;

/// Far more parts than any edge needs whose surroundings are not thin as rounding.
const MOST_PARTS: usize = 10_000;

impl Recovery<'_> {
    pub(super) fn edges(&mut self, merged: &Merged) -> Result<(), TetrahedralizeError> {
        for (&edge, carriers) in &merged.edges {
            let list = self.add_list(carriers);
            self.segment(edge, list)?;
        }
        Ok(())
    }

    /// Makes the segment between two vertices a chain of edges that stay.
    pub(super) fn segment(&mut self, ends: [u32; 2], list: u32) -> Result<(), TetrahedralizeError> {
    pub(super) fn segment(
        &mut self,
        ends: [u32; 2],
        list: u32,
    ) -> Result<(), TetrahedralizeError> {
        let mut open = alloc::vec![ends];
        let mut parts = 0;
        while let Some([a, b]) = open.pop() {
            parts += 1;
            if parts > MOST_PARTS {
                return Err(self.unrecovered(list));
            }
            let split = match self.kept_edges.get(&edge_key(a, b)) {
                Some(&kept) => {
                    self.share(edge_key(a, b), kept, list);
                    kept.split
                }
                None => {
                    let split = self.recover([a, b], list)?;
                    self.keep_parts([a, b], list, split);
                    split
                }
            };
            if split != NONE {
                self.own(split, list);
                open.extend([[split, b], [a, split]]);
            }
        }
        Ok(())
    }

    /// An edge that stays for one reason stays for another too.
    fn share(&mut self, edge: [u32; 2], kept: Kept, list: u32) {
        let [old, new] = [kept.list, list].map(|l| &self.lists[l as usize]);
        let mut union = old.clone();
        union.extend(new.iter().filter(|c| old.iter().all(|o| o.triangle != c.triangle)));
        if union.len() > old.len() {
            self.lists.push(union);
            let list = self.lists.len() as u32 - 1;
            self.kept_edges.insert(edge, Kept { list, ..kept });
        }
    }

    /// Makes a segment an edge ([`NONE`]) or finds or adds a vertex on it.
    fn recover(&mut self, ends: [u32; 2], list: u32) -> Result<u32, TetrahedralizeError> {
        let mut stuck = 0;
        let [mut a, mut b] = ends;
        // Each change leaves fewer faces in the way, so this ends.
        while stuck < 2 {
            let mut star = core::mem::take(&mut self.star);
            let meets = self.complex.look(a, b, &mut star);
            self.star = star;
            let changed = match meets.ok_or(TetrahedralizeError::Arithmetic)? {
                Meets::Nothing => return Ok(NONE),
                Meets::Vertex(v) => return Ok(v),
                Meets::Edge(edge, tet) => self.remove([a, b], edge, tet),
                Meets::Face(tet, corner) => {
                    let [x, y, z] = self.complex.tets[tet as usize].face(corner);
                    if let Some(&other) = self.kept_faces.get(&sorted([x, y, z])) {
                        return Err(self.intersection(list, other));
                    }
                    let free = |c: &Complex, face| !c.pierces([a, b], face);
                    self.complex.face_to_edge(tet, corner, free)
                        || [[x, y], [y, z], [z, x]].into_iter().any(|e| self.remove([a, b], e, tet))
                }
            };
            stuck = if changed { 0 } else { stuck + 1 };
            (a, b) = if changed { (a, b) } else { (b, a) };
        }
        self.divide(ends, list)
    }

    /// Removes an edge if that leaves fewer faces in the way of a segment.
    fn remove(&mut self, [a, b]: [u32; 2], edge: [u32; 2], tet: u32) -> bool {
        if self.is_kept(edge) {
            return false;
        }
        let Some(ring) = self.complex.ring(edge[0], edge[1], tet) else { return false };
        let pierced = |c: &Complex, face| u32::from(c.pierces([a, b], face));
        let [p, q] = edge;
        let now = ring.vertices.iter().map(|&r| pierced(&self.complex, [p, q, r])).sum();
        let diagonal =
            |c: &Complex, [r, s]: [u32; 2]| pierced(c, [p, r, s]) + pierced(c, [q, r, s]);
        self.complex.remove_edge(edge, &ring, now, diagonal, pierced)
    }

    /// Adds a vertex on a segment where it first meets something.
    fn divide(&mut self, [a, b]: [u32; 2], list: u32) -> Result<u32, TetrahedralizeError> {
        let mut star = core::mem::take(&mut self.star);
        let meets = self.complex.look(a, b, &mut star);
        self.star = star;
        let (p, candidates, tet) = match meets {
            Some(Meets::Edge(edge, tet)) => {
                let p = self.complex.on_coplanar([a, b], edge);
                (p, alloc::vec![edge], tet)
            }
            Some(Meets::Face(tet, corner)) => {
                let this = self.complex.tets[tet as usize];
                let [x, y, z] = this.face(corner);
                let p = self.complex.on_segment([a, b], [x, y, z]);
                if let Some(v) = self.insert(p, &[tet, this.neighbors[corner]]) {
                    return Ok(v);
                }
                (p, alloc::vec![[x, y], [y, z], [z, x]], tet)
            }
            _ => return Err(TetrahedralizeError::Arithmetic),
        };
        // Through an edge, or so near to one or to a vertex that rounding has put it there.
        for &edge in &candidates {
            let may = candidates.len() == 1 || !self.is_kept(edge) || self.is_on(edge, p);
            if let Some(v) = may.then(|| self.split_edge(edge, tet, p)).flatten() {
                return Ok(v);
            }
        }
        let ends: Vec<u32> = candidates.into_iter().flatten().collect();
        ends.into_iter().find(|&v| self.are_near(v, p)).ok_or_else(|| self.unrecovered(list))
        ends.into_iter()
            .find(|&v| self.are_near(v, p))
            .ok_or_else(|| self.unrecovered(list))
    }

    fn is_on(&self, [x, y]: [u32; 2], p: drt_math::Vec3) -> bool {
        let [x, y] = [x, y].map(|v| self.complex.points[v as usize]);
        let along = y - x;
        let s = (p - x).dot(along) / along.length_squared();
        (x.lerp(y, s) - p).max_abs() <= super::recovery::ROUNDING
    }
}
