//! Taking out slivers: tetrahedra with next to no height, which turn over as soon as their corners move.
//!
//! A Delaunay tetrahedralization has them wherever four corners lie nearly on one circle, as on the
//! sides of a box. They go by local changes of the connectivity that leave vertices and surfaces alone:
//! an edge is taken out, and the ring of vertices around it filled anew as well as can be (Klincsek
//! 1980; Shewchuk 2002, "Two discrete optimization algorithms for the topological improvement of
//! tetrahedral meshes"), or a face is exchanged for the edge across it. Where all that would only
//! exchange one sliver for another, an edge is bent inwards over a new vertex.

use alloc::vec::Vec;

use drt_math::{Real, Vec3};

use super::Tetrahedralization;
use crate::{Mesh, TetMesh, TetVertexOrigin, weld};

/// A tetrahedron is good enough from this least height on, in parts of its longest edge.
const GOOD: f64 = 0.15;
/// Below this it has none.
const FLAT: f64 = 1e-6;
/// Below this least height a further vertex is worth it.
const SLIVER: f64 = 1e-3;
/// What a change may leave behind at worst: well above the rounding of a height.
const LEAST: f64 = 1e-7;
/// Longer rings are left alone: they can be filled in too many ways.
const LONGEST_RING: usize = 16;
/// Rounds over all tetrahedra; what then is bad stays.
const ROUNDS: usize = 20;
/// A weight below this is none: a vertex on an edge may be found a little inside.
const NO_WEIGHT: f64 = 1e-12;

impl Tetrahedralization {
    /// Exchanges slivers for better tetrahedra as far as that is possible without moving a vertex or
    /// touching a surface, with as few further vertices inside as can be; `surfaces` are those it was made
    /// from.
    ///
    /// Thin tetrahedra remain where surfaces are thin or near to one another.
    ///
    /// # Panics
    /// When it was made from other surfaces.
    pub fn remove_slivers(&mut self, surfaces: &[&Mesh]) {
        self.exchange_below(GOOD, surfaces);
    }

    /// Exchanges only tetrahedra without any height to speak of. Where four vertices of a flat face are
    /// in one plane but for rounding, one of these lies on the face, and beyond it the face is cut into
    /// triangles another way.
    ///
    /// # Panics
    /// When it was made from other surfaces.
    pub fn remove_flat(&mut self, surfaces: &[&Mesh]) {
        self.exchange_below(FLAT, surfaces);
    }

    fn exchange_below(&mut self, good: f64, surfaces: &[&Mesh]) {
        let is_bad = |tet: [Vec3; 4]| quality(tet) < good;
        if !(0..self.mesh.tets.len() as u32).any(|t| is_bad(self.mesh.tet(t))) {
            return;
        }
        let triangles = self.triangles_of_vertices(surfaces);
        let mut around = alloc::vec![Vec::new(); self.mesh.positions.len()];
        for (t, tet) in (0..).zip(&self.mesh.tets) {
            tet.iter().for_each(|v| around[*v as usize].push(t));
        }
        let TetMesh { positions, tets } = core::mem::take(&mut self.mesh);
        let mut complex = Complex { positions, tets, around, triangles };
        for _ in 0..ROUNDS {
            let mut bad: Vec<(f64, u32)> = (0..complex.tets.len() as u32)
                .map(|t| (complex.quality(complex.tets[t as usize]), t))
                .filter(|(q, _)| *q < good)
                .collect();
            bad.sort_by(|a, b| a.0.total_cmp(&b.0));
            let same = |t: u32, q: f64, c: &Complex| c.quality(c.tets[t as usize]) == q;
            let improve = |(q, t): (f64, u32)| same(t, q, &complex) && complex.improve(t);
            if bad.into_iter().map(improve).filter(|done| *done).count() == 0 {
                break;
            }
        }
        self.origins.resize(complex.positions.len(), TetVertexOrigin::Inside);
        let tets = complex.tets.into_iter().filter(|t| *t != GONE).collect();
        self.mesh = TetMesh { positions: complex.positions, tets };
    }

    /// The triangles of surfaces that each vertex lies on, sorted.
    fn triangles_of_vertices(&self, surfaces: &[&Mesh]) -> Vec<Vec<(u32, u32)>> {
        let welded: Vec<Vec<u32>> = surfaces.iter().map(|s| weld(&s.positions)).collect();
        let corners = |surface: usize, t: u32| {
            surfaces[surface].triangles[t as usize].map(|v| welded[surface][v as usize])
        };
        let mut fans: Vec<Vec<Vec<u32>>> =
            surfaces.iter().map(|s| alloc::vec![Vec::new(); s.positions.len()]).collect();
        for (s, surface) in surfaces.iter().enumerate() {
            for t in 0..surface.triangles.len() as u32 {
                corners(s, t).iter().for_each(|v| fans[s][*v as usize].push(t));
            }
        }
        let first = self.origins.iter().copied().zip(0..).map(|(origin, v)| (v, origin));
        let mut of = alloc::vec![Vec::new(); self.origins.len()];
        for (v, origin) in first.chain(self.shared.iter().copied()) {
            let TetVertexOrigin::Surface { surface, triangle, bary: [b, c] } = origin else {
                continue;
            };
            let s = surface as usize;
            let weights = [1.0 - b - c, b, c];
            let on: Vec<u32> = (0..3)
                .filter(|k| weights[*k].abs() > NO_WEIGHT)
                .map(|k| corners(s, triangle)[k])
                .collect();
            let holds = |t: &&u32| on.iter().all(|v| corners(s, **t).contains(v));
            let fan = fans[s][on[0] as usize].iter().filter(holds);
            of[v as usize].extend(fan.map(|t| (surface, *t)));
        }
        of.iter_mut().for_each(|list: &mut Vec<_>| list.sort_unstable());
        of
    }
}

/// What is left of a tetrahedron that has been exchanged.
const GONE: [u32; 4] = [crate::NONE; 4];

struct Complex {
    positions: Vec<Vec3>,
    tets: Vec<[u32; 4]>,
    /// The tetrahedra at each vertex.
    around: Vec<Vec<u32>>,
    /// The surface triangles at each vertex.
    triangles: Vec<Vec<(u32, u32)>>,
}

/// The best way found to fill a part of a ring, from one vertex to another.
#[derive(Clone, Copy, Default)]
struct Filling {
    quality: f64,
    /// The third vertex of the triangle over the two.
    apex: usize,
}

impl Complex {
    /// The least height over the longest edge; negative for a tetrahedron that is turned over.
    fn quality(&self, tet: [u32; 4]) -> f64 {
        if tet == GONE { f64::INFINITY } else { self.quality_with(tet, Vec3::ZERO) }
    }

    /// The same where the next vertex would be at `place`.
    fn quality_with(&self, tet: [u32; 4], place: Vec3) -> f64 {
        quality(tet.map(|v| self.positions.get(v as usize).copied().unwrap_or(place)))
    }

    /// Exchanges a tetrahedron together with neighbours; false when nothing better is found.
    fn improve(&mut self, t: u32) -> bool {
        let [a, b, c, d] = self.tets[t as usize];
        let edges = [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]];
        let faces = [[b, c, d, a], [a, d, c, b], [a, b, d, c], [a, c, b, d]];
        edges.into_iter().any(|edge| self.remove_edge(edge))
            || faces.into_iter().any(|face| self.remove_face(t, face))
            || self.bend_edge(t, edges)
    }

    /// Splits one of the edges of a sliver at a vertex off it, if the worst around it gets much better.
    fn bend_edge(&mut self, t: u32, edges: [[u32; 2]; 6]) -> bool {
        if self.quality(self.tets[t as usize]) > SLIVER {
            return false;
        }
        let mut best: Option<(f64, Vec<u32>, Vec3)> = None;
        for [a, b] in edges {
            let Some((old, ring)) = self.ring(a, b) else { continue };
            if ring.iter().any(|v| self.is_on_surface([a, b, *v])) {
                continue;
            }
            // Away from the sliver: to the middle of all around, whose other parts are thick.
            let all = ring.iter().copied().chain([a, b]).map(|v| self.positions[v as usize]);
            let place = all.fold(Vec3::ZERO, |s, p| s + p) * (1.0 / (ring.len() + 2) as f64);
            let parts = self.split(&old, [a, b]);
            let worst = parts.map(|t| self.quality_with(t, place)).fold(f64::INFINITY, f64::min);
            if worst > best.as_ref().map_or(10.0 * SLIVER, |b| b.0) {
                best = Some((worst, old, place));
            }
        }
        let Some((_, old, place)) = best else { return false };
        let shared = |v: &u32| old.iter().all(|t| self.tets[*t as usize].contains(v));
        let ends: Vec<u32> = self.tets[t as usize].into_iter().filter(shared).collect();
        let &[a, b] = &*ends else { return false };
        let new: Vec<[u32; 4]> = self.split(&old, [a, b]).collect();
        self.positions.push(place);
        self.triangles.push(Vec::new());
        self.around.push(Vec::new());
        self.exchange(&old, &new);
        true
    }

    /// Tetrahedra around an edge with one of its ends, each in turn, replaced by the next vertex.
    fn split(&self, old: &[u32], ends: [u32; 2]) -> impl Iterator<Item = [u32; 4]> {
        let next = self.positions.len() as u32;
        let parts = old.iter().flat_map(move |t| {
            let tet = self.tets[*t as usize];
            ends.map(|end| tet.map(|v| if v == end { next } else { v }))
        });
        parts.collect::<Vec<_>>().into_iter()
    }

    /// True where three vertices span a part of a surface.
    fn is_on_surface(&self, face: [u32; 3]) -> bool {
        let [a, b, c] = face.map(|v| &self.triangles[v as usize]);
        a.iter().any(|t| b.binary_search(t).is_ok() && c.binary_search(t).is_ok())
    }

    /// Fills the ring around an edge without it, if the worst tetrahedron gets better.
    fn remove_edge(&mut self, [a, b]: [u32; 2]) -> bool {
        let Some((old, ring)) = self.ring(a, b) else { return false };
        if ring.iter().any(|v| self.is_on_surface([a, b, *v])) {
            return false;
        }
        let worst =
            old.iter().fold(f64::INFINITY, |m, t| m.min(self.quality(self.tets[*t as usize])));
        let n = ring.len();
        let mut best = [[Filling { quality: f64::INFINITY, apex: 0 }; LONGEST_RING]; LONGEST_RING];
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                let over = |k: usize| {
                    let own = pair([a, b], [ring[i], ring[k], ring[j]]).map(|t| self.quality(t));
                    let quality =
                        own[0].min(own[1]).min(best[i][k].quality).min(best[k][j].quality);
                    Filling { quality, apex: k }
                };
                let better = |x: Filling, y: Filling| if y.quality > x.quality { y } else { x };
                best[i][j] = (i + 2..j).map(over).fold(over(i + 1), better);
            }
        }
        if best[0][n - 1].quality <= f64::max(worst, LEAST) {
            return false;
        }
        let mut new = Vec::new();
        let mut open = alloc::vec![(0, n - 1)];
        while let Some((i, j)) = open.pop() {
            if j > i + 1 {
                let k = best[i][j].apex;
                new.extend(pair([a, b], [ring[i], ring[k], ring[j]]));
                open.extend([(i, k), (k, j)]);
            }
        }
        self.exchange(&old, &new);
        true
    }

    /// The tetrahedra around an edge, and the vertices around it, counter-clockwise seen from `b`; `None`
    /// at the boundary, and for long rings.
    fn ring(&self, a: u32, b: u32) -> Option<(Vec<u32>, Vec<u32>)> {
        let star = self.around[a as usize].iter().copied();
        let old: Vec<u32> = star.filter(|t| self.tets[*t as usize].contains(&b)).collect();
        if !(3..=LONGEST_RING).contains(&old.len()) {
            return None;
        }
        let sides: Vec<[u32; 2]> =
            old.iter().map(|t| across(self.tets[*t as usize], a, b)).collect();
        let mut ring = alloc::vec![sides[0][0]];
        while ring.len() < old.len() {
            let last = ring[ring.len() - 1];
            ring.push(sides.iter().find(|s| s[0] == last)?[1]);
        }
        let last = ring[ring.len() - 1];
        let closes = sides.iter().any(|s| *s == [last, ring[0]]);
        closes.then_some((old, ring))
    }

    /// Exchanges a face of a tetrahedron, given with the corner opposite to it, for the edge from that
    /// corner to the one on the face's other side.
    fn remove_face(&mut self, t: u32, [a, b, c, top]: [u32; 4]) -> bool {
        if self.is_on_surface([a, b, c]) {
            return false;
        }
        let star = self.around[a as usize].iter().copied();
        let shares = |s: &u32| *s != t && [b, c].iter().all(|v| self.tets[*s as usize].contains(v));
        let Some(other) = star.into_iter().find(shares) else { return false };
        let far = self.tets[other as usize].into_iter().find(|v| ![a, b, c].contains(v));
        let Some(far) = far else { return false };
        let worst = [t, other].map(|t| self.quality(self.tets[t as usize]));
        // From the far side the face runs counter-clockwise.
        let new = [[a, b], [b, c], [c, a]].map(|[p, q]| [far, top, p, q]);
        let new = new.map(|t| if self.quality(t) < 0.0 { [t[1], t[0], t[2], t[3]] } else { t });
        let right = self.fills([t, other], &new);
        let quality = new.iter().fold(f64::INFINITY, |m, t| m.min(self.quality(*t)));
        if !right || quality <= f64::max(worst[0].min(worst[1]), LEAST) {
            return false;
        }
        self.exchange(&[t, other], &new);
        true
    }

    /// Whether positive tetrahedra have the volume of those they are to replace: else they overlap.
    fn fills(&self, old: [u32; 2], new: &[[u32; 4]]) -> bool {
        let volume = |tet: [u32; 4]| {
            let [a, b, c, d] = tet.map(|v| self.positions[v as usize]);
            (b - a).cross(c - a).dot(d - a)
        };
        let before: f64 = old.iter().map(|t| volume(self.tets[*t as usize])).sum();
        let after: f64 = new.iter().map(|t| volume(*t)).sum();
        Real::abs(after - before) <= 1e-9 * before
    }

    fn exchange(&mut self, old: &[u32], new: &[[u32; 4]]) {
        for t in old {
            for v in core::mem::replace(&mut self.tets[*t as usize], GONE) {
                self.around[v as usize].retain(|other| other != t);
            }
        }
        for tet in new {
            let t = self.tets.len() as u32;
            self.tets.push(*tet);
            tet.iter().for_each(|v| self.around[*v as usize].push(t));
        }
    }
}

/// The least height of a tetrahedron over its longest edge; negative for one that is turned over.
fn quality([a, b, c, d]: [Vec3; 4]) -> f64 {
    let (e1, e2, e3) = (b - a, c - a, d - a);
    let volume = e1.cross(e2).dot(e3);
    let areas = [e1.cross(e2), e2.cross(e3), e3.cross(e1), (c - b).cross(d - b)];
    let area = areas.iter().fold(0.0, |m, n| f64::max(m, n.length_squared()));
    let edges = [e1, e2, e3, c - b, d - b, d - c];
    let edge = edges.iter().fold(0.0, |m, e| f64::max(m, e.length_squared()));
    volume / Real::sqrt(area * edge)
}

/// The tetrahedra over and under a triangle of the ring around an edge.
fn pair([a, b]: [u32; 2], [i, k, j]: [u32; 3]) -> [[u32; 4]; 2] {
    [[a, i, k, j], [b, i, j, k]]
}

/// The edge of a tetrahedron across from the edge a, b, so that (a, b, r, s) is an even permutation.
fn across(tet: [u32; 4], a: u32, b: u32) -> [u32; 2] {
    let mut t = tet;
    let mut even = true;
    for (k, v) in [a, b].into_iter().enumerate() {
        let at = (k..4).find(|i| t[*i] == v).unwrap_or(k);
        if at != k {
            t.swap(at, k);
            even = !even;
        }
    }
    if even { [t[2], t[3]] } else { [t[3], t[2]] }
}
