//! Input edges become chains of edges of the complex.

use drt_math::Vec3;

use super::TetrahedralizeError;
use super::complex::ROUNDING;
use super::flips::Wanted;
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
        let wanted = Wanted::Edge(ends);
        let [mut a, mut b] = ends;
        let (mut stuck, mut trials) = (0, self.allowance());
        // Each change but the trials leaves fewer faces in the way, so this ends.
        while stuck < 2 {
            let (edge, tet, changed) = match self.look(a, b)? {
                Meets::Nothing(tet) => return Ok(self.touch([a, b], tet).unwrap_or(NONE)),
                Meets::Vertex(v) => return Ok(v),
                Meets::Edge(edge, _) if self.is_kept(edge) => return self.divide([a, b], list),
                Meets::Edge(edge, tet) => (edge, tet, self.remove_edge(edge, tet, wanted, 1)),
                Meets::Face(tet, corner) => {
                    let [x, y, z] = self.complex.tets[tet as usize].face(corner);
                    let mut edges = [[x, y], [y, z], [z, x]].into_iter();
                    let changed = self.remove_face(tet, corner, wanted, 1)
                        || edges.any(|e| self.remove_edge(e, tet, wanted, 1));
                    ([x, y], tet, changed)
                }
            };
            if changed || self.shuffle(&[(edge, tet)], wanted, &mut trials) {
                stuck = 0;
            } else {
                stuck += 1;
                (a, b) = (b, a);
            }
        }
        self.divide(ends, list)
    }

    /// A vertex on an edge that is there, up to rounding, or one added where an edge that stays
    /// crosses it: four vertices almost in a plane may have edges both ways.
    fn touch(&mut self, [a, b]: [u32; 2], tet: u32) -> Option<u32> {
        let ring = self.complex.ring(a, b, tet)?;
        let n = ring.tets.len();
        for i in 0..n {
            let (r, s) = (ring.vertices[i], ring.vertices[(i + 1) % n]);
            if self.complex.is_thick([a, b, r, s]) {
                continue;
            }
            let at = |v: u32| self.complex.points[v as usize];
            if let Some(v) = [r, s].into_iter().find(|&v| self.is_on([a, b], at(v))) {
                return Some(v);
            }
            let p = self.complex.on_coplanar([a, b], [r, s]);
            if let Some(&kept) = self.kept_edges.get(&edge_key(r, s))
                && self.is_on([a, b], p)
                && self.is_on([r, s], p)
            {
                let mut around = ring.tets;
                let across = self.complex.ring(r, s, around[i])?;
                around.extend(across.tets);
                around.sort_unstable();
                around.dedup();
                let v = self.insert(p, &around, Some([r, s]))?;
                self.split_kept([r, s], kept, v);
                return Some(v);
            }
        }
        None
    }

    /// What a segment meets first, where what is as near as rounding is met.
    fn look(&mut self, a: u32, b: u32) -> Result<Meets, TetrahedralizeError> {
        let mut star = core::mem::take(&mut self.star);
        let meets = self.complex.look(a, b, &mut star);
        self.star = star;
        let meets = meets.ok_or(TetrahedralizeError::Arithmetic)?;
        let (p, tet, vertices) = match meets {
            Meets::Nothing(_) | Meets::Vertex(_) => return Ok(meets),
            Meets::Edge(edge, tet) => (self.complex.on_coplanar([a, b], edge), tet, edge.to_vec()),
            Meets::Face(tet, corner) => {
                let face = self.complex.tets[tet as usize].face(corner);
                (self.complex.on_segment([a, b], face), tet, face.to_vec())
            }
        };
        if let Some(&v) = vertices.iter().find(|&&v| self.are_near(v, p)) {
            return Ok(Meets::Vertex(v));
        }
        let edges = (0..vertices.len()).map(|k| [vertices[k], vertices[(k + 1) % vertices.len()]]);
        let near = edges.into_iter().find(|&e| self.is_on(e, p));
        Ok(near.map_or(meets, |edge| Meets::Edge(edge, tet)))
    }

    /// Adds a vertex on a segment where it first meets something.
    fn divide(&mut self, [a, b]: [u32; 2], list: u32) -> Result<u32, TetrahedralizeError> {
        let added = match self.look(a, b)? {
            Meets::Nothing(_) => return Ok(NONE),
            Meets::Vertex(v) => return Ok(v),
            Meets::Edge(edge, tet) => {
                let p = self.complex.on_coplanar([a, b], edge);
                self.split_edge(edge, tet, p)
            }
            Meets::Face(tet, corner) => {
                let this = self.complex.tets[tet as usize];
                let p = self.complex.on_segment([a, b], this.face(corner));
                self.insert(p, &[tet, this.neighbors[corner]], None)
            }
        };
        added.ok_or_else(|| self.unrecovered(list))
    }

    /// Whether a point is on the inside of an edge, up to rounding.
    fn is_on(&self, [x, y]: [u32; 2], p: Vec3) -> bool {
        let [x, y] = [x, y].map(|v| self.complex.points[v as usize]);
        let along = y - x;
        let s = (p - x).dot(along) / along.length_squared();
        s > 0.0 && s < 1.0 && (x.lerp(y, s) - p).max_abs() <= ROUNDING
    }
}
