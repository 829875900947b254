//! Tetrahedra that know their neighbours, and the one way to change them: replace some by others
//! that fill the same space.

use alloc::vec::Vec;

use drt_math::Vec3;

use super::faces::{FaceTable, TetCorner};
use super::predicates::orient;
use crate::NONE;

/// For each corner the three others, so that the corner and they are a positive tetrahedron.
pub(super) const OPPOSITE: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// How far a vertex may be moved onto an input edge or triangle, of the largest coordinate: some
/// roundings.
pub(super) const ROUNDING: f64 = 1e-14;

/// A positive tetrahedron, or a vacant place when its first vertex is [`NONE`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Tet {
    pub(super) vertices: [u32; 4],
    /// The tetrahedron across from each vertex; [`NONE`] outside the box.
    pub(super) neighbors: [u32; 4],
}

impl Tet {
    pub(super) fn has(&self, v: u32) -> bool {
        self.vertices.contains(&v)
    }
    pub(super) fn corner(&self, v: u32) -> usize {
        self.vertices.iter().position(|&w| w == v).expect("a vertex of the tetrahedron")
    }
    /// The face across from a corner, counter-clockwise seen from outside.
    pub(super) fn face(&self, corner: usize) -> [u32; 3] {
        OPPOSITE[corner].map(|k| self.vertices[k])
    }
    /// The other two vertices beside an edge, so that `p, q, r, s` is positive.
    fn beside(&self, p: u32, q: u32) -> [u32; 2] {
        let [x, y, z] = self.face(self.corner(p));
        match q {
            _ if q == x => [y, z],
            _ if q == y => [z, x],
            _ => [x, y],
        }
    }
}

/// The tetrahedra around an inner edge.
#[derive(Debug, Default)]
pub(super) struct Ring {
    /// Counter-clockwise seen from the edge's second vertex.
    pub(super) tets: Vec<u32>,
    /// Tetrahedron `i` has vertices `i` and `i + 1` (around the end: 0).
    pub(super) vertices: Vec<u32>,
}

#[derive(Debug, Default)]
pub(super) struct Complex {
    pub(super) points: Vec<Vec3>,
    pub(super) tets: Vec<Tet>,
    vacant: Vec<u32>,
    /// A tetrahedron of each vertex.
    home: Vec<u32>,
    /// Which tetrahedra the current search has seen.
    seen: Vec<u32>,
    search: u32,
    table: FaceTable,
    made: Vec<[u32; 4]>,
}

impl Complex {
    /// A complex of positive tetrahedra that fill a convex shape.
    pub(super) fn new(points: Vec<Vec3>, tets: &[[u32; 4]]) -> Self {
        let home = alloc::vec![NONE; points.len()];
        let mut complex = Self { points, home, ..Self::default() };
        complex.replace(&[], tets);
        complex
    }

    pub(super) fn add_point(&mut self, p: Vec3) -> u32 {
        self.points.push(p);
        self.home.push(NONE);
        self.points.len() as u32 - 1
    }

    /// Takes back the last point, which must be in no tetrahedron.
    pub(super) fn remove_last_point(&mut self) {
        self.points.pop();
        self.home.pop();
    }

    pub(super) fn orient(&self, vertices: [u32; 4]) -> f64 {
        orient(vertices.map(|v| self.points[v as usize]))
    }

    pub(super) fn corners(&self, tet: u32) -> [Vec3; 4] {
        self.tets[tet as usize].vertices.map(|v| self.points[v as usize])
    }

    /// Begins a search that has seen nothing.
    pub(super) fn begin_search(&mut self) {
        self.search += 1;
    }

    /// True the first time the current search asks.
    pub(super) fn first_visit(&mut self, tet: u32) -> bool {
        core::mem::replace(&mut self.seen[tet as usize], self.search) != self.search
    }

    fn was_seen(&self, tet: u32) -> bool {
        self.seen[tet as usize] == self.search
    }

    /// Puts `new` in the place of `old`; both must fill the same space.
    pub(super) fn replace(&mut self, old: &[u32], new: &[[u32; 4]]) {
        self.begin_search();
        for &t in old {
            self.first_visit(t);
        }
        self.table.clear();
        for &t in old {
            let tet = self.tets[t as usize];
            for corner in 0..4 {
                let outer = tet.neighbors[corner];
                if outer == NONE || !self.was_seen(outer) {
                    // Found while the numbers are still unique: new tetrahedra take old places.
                    let back = (outer != NONE).then(|| {
                        let n = &self.tets[outer as usize].neighbors;
                        n.iter().position(|&b| b == t).expect("neighbours know each other")
                    });
                    let side = TetCorner { tet: outer, corner: back.unwrap_or(0) as u32 };
                    self.table.take_or_insert(tet.face(corner), side);
                }
            }
        }
        for &t in old {
            self.tets[t as usize].vertices[0] = NONE;
            self.vacant.push(t);
        }
        for &vertices in new {
            let t = self.place(vertices);
            for corner in 0..4 {
                let face = self.tets[t as usize].face(corner);
                let side = TetCorner { tet: t, corner: corner as u32 };
                if let Some(other) = self.table.take_or_insert(face, side) {
                    self.tets[t as usize].neighbors[corner] = other.tet;
                    if other.tet != NONE {
                        self.tets[other.tet as usize].neighbors[other.corner as usize] = t;
                    }
                }
            }
            for v in vertices {
                self.home[v as usize] = t;
            }
        }
    }

    fn place(&mut self, vertices: [u32; 4]) -> u32 {
        let tet = Tet { vertices, neighbors: [NONE; 4] };
        match self.vacant.pop() {
            Some(t) => {
                self.tets[t as usize] = tet;
                t
            }
            None => {
                self.tets.push(tet);
                self.seen.push(0);
                self.tets.len() as u32 - 1
            }
        }
    }

    /// Replaces tetrahedra by the cone of a vertex over their common hull.
    ///
    /// # Errors
    /// When one of the cone's would not be positive: the tetrahedron beyond its face of the hull.
    pub(super) fn replace_by_cone(&mut self, old: &[u32], apex: u32) -> Result<(), u32> {
        let mut made = core::mem::take(&mut self.made);
        made.clear();
        let mut blocked = None;
        self.hull(old, |complex, [x, y, z], beyond| {
            made.push([apex, x, y, z]);
            if blocked.is_none() && complex.orient([apex, x, y, z]) <= 0.0 {
                blocked = Some(beyond);
            }
        });
        if blocked.is_none() {
            self.replace(old, &made);
        }
        self.made = made;
        blocked.map_or(Ok(()), Err)
    }

    /// Visits the faces around some tetrahedra, each counter-clockwise seen from outside, with the
    /// tetrahedron beyond ([`NONE`] outside the box).
    pub(super) fn hull(&mut self, of: &[u32], mut visit: impl FnMut(&Self, [u32; 3], u32)) {
        self.begin_search();
        for &t in of {
            self.first_visit(t);
        }
        for &t in of {
            let tet = self.tets[t as usize];
            for (corner, &outer) in tet.neighbors.iter().enumerate() {
                if outer == NONE || !self.was_seen(outer) {
                    visit(self, tet.face(corner), outer);
                }
            }
        }
    }

    /// Some tetrahedron of a vertex.
    pub(super) fn home(&self, v: u32) -> u32 {
        self.home[v as usize]
    }

    /// All tetrahedra of a vertex.
    pub(super) fn star(&mut self, v: u32, star: &mut Vec<u32>) {
        star.clear();
        self.begin_search();
        let home = self.home(v);
        self.first_visit(home);
        star.push(home);
        let mut next = 0;
        while next < star.len() {
            let tet = self.tets[star[next] as usize];
            next += 1;
            let own = tet.corner(v);
            for corner in (0..4).filter(|&k| k != own) {
                let n = tet.neighbors[corner];
                if n != NONE && self.first_visit(n) {
                    star.push(n);
                }
            }
        }
    }

    /// A tetrahedron that has an edge, if there is such an edge.
    pub(super) fn tet_with(&mut self, p: u32, q: u32, star: &mut Vec<u32>) -> Option<u32> {
        self.star(p, star);
        star.iter().copied().find(|&t| self.tets[t as usize].has(q))
    }

    /// The ring of an edge, beginning at one of its tetrahedra; none when it is open, at the
    /// surface of the box.
    pub(super) fn ring(&self, p: u32, q: u32, start: u32) -> Option<Ring> {
        let mut ring = Ring::default();
        let mut t = start;
        loop {
            let tet = &self.tets[t as usize];
            let [r, _] = tet.beside(p, q);
            ring.tets.push(t);
            ring.vertices.push(r);
            t = tet.neighbors[tet.corner(r)];
            if t == NONE {
                return None;
            }
            if t == start {
                return Some(ring);
            }
        }
    }

    /// The tetrahedra in use.
    pub(super) fn live(&self) -> impl Iterator<Item = &Tet> {
        self.tets.iter().filter(|t| t.vertices[0] != NONE)
    }
}
