//! Input edges and triangles as edges and faces of the complex: what is there already, and what
//! lies on what.
//!
//! All decisions are exact for the coordinates as they are. A vertex added on an input edge or
//! triangle is rounded, so that the edge or triangle bends by as much; from then on it is that bent
//! one that is recovered, and the complex is a valid one at every moment.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use drt_math::{Rng, Vec3, vec3};

use super::complex::{Complex, ROUNDING};
use super::faces::sorted;
use super::flips::Wanted;
use super::input::{Carrier, FIRST, Merged, Named, edge_key};
use super::{SurfaceTriangle, TetrahedralizeError};
use crate::NONE;

/// Changes tried at random, in all and with some more for each vertex: where many edges are
/// missing, trials cost more than the vertices that they save.
const ALL_TRIALS: usize = 5000;
const TRIALS_PER_VERTEX: usize = 4;

/// Places tried for a vertex, within some roundings of where it should be.
const MOST_PLACES: u32 = 16;

/// How many further tetrahedra make way for a vertex.
const MOST_MORE: usize = 12;

/// An edge that must stay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    /// Which list of carriers.
    pub(super) list: u32,
    /// The vertex at which it is two; [`NONE`] while it is one.
    pub(super) split: u32,
}

pub(super) struct Recovery<'a> {
    pub(super) complex: Complex,
    /// Edges that must stay, whole ones and those they are made of.
    pub(super) kept_edges: BTreeMap<[u32; 2], Kept>,
    /// Faces that must stay, and an input triangle that each is part of.
    pub(super) kept_faces: BTreeMap<[u32; 3], u32>,
    /// What an edge or triangle, and so each vertex added there, lies on.
    pub(super) lists: Vec<Vec<Carrier>>,
    /// What each vertex lies on.
    pub(super) owners: Vec<Vec<Carrier>>,
    pub(super) named: &'a [Named],
    pub(super) star: Vec<u32>,
    rng: Rng,
    trials: usize,
}

impl<'a> Recovery<'a> {
    pub(super) fn new(complex: Complex, merged: &'a Merged) -> Self {
        let mut owners = alloc::vec![Vec::new(); FIRST as usize];
        owners.extend_from_slice(&merged.owners);
        Self {
            complex,
            kept_edges: BTreeMap::new(),
            kept_faces: BTreeMap::new(),
            lists: Vec::new(),
            owners,
            named: &merged.named,
            star: Vec::new(),
            rng: Rng::new(4, 0, 0),
            trials: ALL_TRIALS + TRIALS_PER_VERTEX * merged.positions.len(),
        }
    }

    pub(super) fn add_list(&mut self, carriers: &[Carrier]) -> u32 {
        self.lists.push(carriers.to_vec());
        self.lists.len() as u32 - 1
    }

    pub(super) fn is_kept(&self, [a, b]: [u32; 2]) -> bool {
        self.kept_edges.contains_key(&edge_key(a, b))
    }

    /// Notes that a vertex also lies on what is listed.
    pub(super) fn own(&mut self, v: u32, list: u32) {
        let owners = &mut self.owners[v as usize];
        for carrier in &self.lists[list as usize] {
            if owners.iter().all(|o| o.triangle != carrier.triangle) {
                owners.push(*carrier);
            }
        }
    }

    /// Adds a vertex in the place of the given tetrahedra, and of more where these are thin as
    /// rounding, at a point or a few roundings from it. None when that cannot be without losing
    /// an edge that must stay, other than `split`.
    pub(super) fn insert(&mut self, p: Vec3, old: &[u32], split: Option<[u32; 2]>) -> Option<u32> {
        let v = self.complex.add_point(p);
        let step = p.max_abs() * f64::EPSILON;
        for trial in 0..MOST_PLACES {
            let mut cavity = old.to_vec();
            while cavity.len() < old.len() + MOST_MORE {
                match self.complex.replace_by_cone(&cavity, v) {
                    Ok(()) => {
                        self.owners.push(Vec::new());
                        return Some(v);
                    }
                    Err(NONE) => break,
                    Err(beyond) => cavity.push(beyond),
                }
                if self.loses(&cavity, split) {
                    break;
                }
            }
            let mut off = || (self.rng.next_f64() - 0.5) * step * f64::from(2 + trial / 4);
            self.complex.points[v as usize] = p + vec3(off(), off(), off());
        }
        self.complex.remove_last_point();
        None
    }

    /// Whether a vertex, or an edge or face that must stay, is not on the hull of tetrahedra.
    fn loses(&mut self, tets: &[u32], split: Option<[u32; 2]>) -> bool {
        let split = split.map(|[a, b]| edge_key(a, b));
        let (mut vertices, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
        self.complex.hull(tets, |_, [x, y, z], _| {
            vertices.extend([x, y, z]);
            edges.extend([edge_key(x, y), edge_key(y, z), edge_key(z, x)]);
            faces.push(sorted([x, y, z]));
        });
        tets.iter().any(|&t| {
            let tet = &self.complex.tets[t as usize];
            let v = tet.vertices;
            let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
            let lost_edge = |&(i, j): &(usize, usize)| {
                let edge = edge_key(v[i], v[j]);
                Some(edge) != split && self.is_kept(edge) && !edges.contains(&edge)
            };
            let lost_face = |corner: usize| {
                let face = sorted(tet.face(corner));
                self.kept_faces.contains_key(&face) && !faces.contains(&face)
            };
            v.iter().any(|w| !vertices.contains(w))
                || pairs.iter().any(lost_edge)
                || (0..4).any(lost_face)
        })
    }

    /// Splits an inner edge of a tetrahedron at a point near it.
    pub(super) fn split_edge(&mut self, [a, b]: [u32; 2], tet: u32, p: Vec3) -> Option<u32> {
        let ring = self.complex.ring(a, b, tet)?;
        let v = self.insert(p, &ring.tets, Some([a, b]))?;
        if let Some(&kept) = self.kept_edges.get(&edge_key(a, b)) {
            self.split_kept([a, b], kept, v);
        }
        Some(v)
    }

    /// What must stay does so in parts.
    pub(super) fn split_kept(&mut self, [a, b]: [u32; 2], kept: Kept, v: u32) {
        self.keep_parts([a, b], kept.list, v);
        self.keep_parts([a, v], kept.list, NONE);
        self.keep_parts([v, b], kept.list, NONE);
        self.own(v, kept.list);
    }

    /// Notes that an edge must stay, whole ([`NONE`]) or in two parts.
    pub(super) fn keep_parts(&mut self, [a, b]: [u32; 2], list: u32, split: u32) {
        self.kept_edges.insert(edge_key(a, b), Kept { list, split });
    }

    pub(super) fn name(&self, triangle: u32) -> SurfaceTriangle {
        self.named[triangle as usize].name
    }

    /// Why what is listed cannot be recovered: a triangle is in its way.
    pub(super) fn intersection(&self, list: u32, triangle: u32) -> TetrahedralizeError {
        let own = self.lists[list as usize][0].triangle;
        if own == triangle {
            return self.unrecovered(list);
        }
        let (first, second) = (self.name(own.min(triangle)), self.name(own.max(triangle)));
        TetrahedralizeError::Intersection { first, second }
    }

    pub(super) fn unrecovered(&self, list: u32) -> TetrahedralizeError {
        let own = self.lists[list as usize][0].triangle;
        TetrahedralizeError::Unrecovered { triangle: self.name(own) }
    }

    pub(super) fn are_near(&self, v: u32, p: Vec3) -> bool {
        (self.complex.points[v as usize] - p).max_abs() <= ROUNDING
    }

    /// Removes an edge that need not stay, with the gain asked for.
    pub(super) fn remove_edge(
        &mut self,
        edge: [u32; 2],
        tet: u32,
        wanted: Wanted<'_>,
        gain: u32,
    ) -> bool {
        !self.is_kept(edge) && self.complex.remove_edge(edge, tet, wanted, gain)
    }

    /// Removes a face that need not stay, with the gain asked for.
    pub(super) fn remove_face(
        &mut self,
        tet: u32,
        corner: usize,
        wanted: Wanted<'_>,
        gain: u32,
    ) -> bool {
        let face = self.complex.tets[tet as usize].face(corner);
        !self.kept_faces.contains_key(&sorted(face))
            && self.complex.remove_face(tet, corner, wanted, gain)
    }

    /// How many changes may be tried at random before a vertex is added.
    pub(super) fn allowance(&self) -> usize {
        usize::min(200, self.trials / 16)
    }

    /// Changes something near edges, each given with a tetrahedron, that leaves no more in the way
    /// than there is: after that there may be a change for the better. False when the trials are
    /// used up.
    pub(super) fn shuffle(
        &mut self,
        edges: &[([u32; 2], u32)],
        wanted: Wanted<'_>,
        trials: &mut usize,
    ) -> bool {
        while *trials > 0 {
            *trials -= 1;
            self.trials -= 1;
            let mut pick = |n: usize| self.rng.next_u32() as usize % n;
            let ([p, q], tet) = edges[pick(edges.len())];
            let Some(ring) = self.complex.ring(p, q, tet) else { continue };
            let tet = ring.tets[pick(ring.tets.len())];
            let (corner, other) = (pick(4), pick(3));
            let changed = if pick(3) == 0 {
                self.remove_face(tet, corner, wanted, 0)
            } else {
                let v = self.complex.tets[tet as usize].vertices;
                self.remove_edge([v[corner], v[(corner + other + 1) % 4]], tet, wanted, 0)
            };
            if changed {
                return true;
            }
        }
        false
    }
}
