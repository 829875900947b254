//! The segments along which triangles pass through each other.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::{Real, Vec3};

use crate::crossing::near;
use crate::{Mesh, NONE, Topology, is_usable, weld};

/// Distance from a plane, over the smaller of the two surfaces' mean triangle sizes, within which a corner counts as on it: what
/// coordinates in files written with single precision are off by. One for two surfaces, so that neighbours agree.
const ON: f64 = 1e-6;

/// Sine of the angle between planes below which nothing is said of where they meet.
const PARALLEL: f64 = 1e-4;

/// A segment along which two surfaces, or two parts of one, pass through each other.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CrossingSegment {
    /// Where it starts and ends.
    pub ends: [Vec3; 2],
    /// The surfaces, by their indices.
    pub surfaces: [u32; 2],
    /// Of each, its triangles on the two sides of the segment: one twice, or the two at an edge that the
    /// segment runs along.
    pub triangles: [[u32; 2]; 2],
    /// Unit, across the segment into these.
    pub across: [[Vec3; 2]; 2],
}

/// The segments along which surfaces pass through each other or themselves, in the order of their triangles.
///
/// Not among them are segments at which a surface ends or turns back: what rests on another surface, or touches
/// it. Nor are those of surfaces that overlap in a plane or nearly so, and of triangles of one surface with a corner in
/// common. Where three surfaces and more intersect along one line, any two of them have a segment there. Positions are
/// right up to rounding; corners within a millionth of the mean size of triangles of a plane count as on it.
///
/// Triangles without area, those with coordinates that are not finite, and surfaces with an index out of range meet
/// nothing. The cost is near linear in the number of triangles.
///
/// ```
/// use drt_geom::{Mesh, crossing_segments};
/// use drt_math::vec3;
///
/// let sheet = |corners: [_; 3]| Mesh::new(corners.to_vec(), vec![[0, 1, 2]]);
/// let flat = sheet([vec3(-2.0, -2.0, 0.0), vec3(2.0, -2.0, 0.0), vec3(0.0, 2.0, 0.0)])?;
/// let upright = sheet([vec3(0.0, -0.5, -1.0), vec3(0.0, 0.5, -1.0), vec3(0.0, 0.0, 1.0)])?;
/// let found = crossing_segments(&[&flat, &upright]);
/// assert_eq!(found.len(), 1);
/// assert!(((found[0].ends[1] - found[0].ends[0]).length() - 0.5).abs() < 1e-12);
/// # Ok::<(), drt_geom::MeshError>(())
/// ```
#[must_use]
pub fn crossing_segments(surfaces: &[&Mesh]) -> Vec<CrossingSegment> {
    let mut triangles = Vec::new();
    for (surface, mesh) in (0..).zip(surfaces) {
        let first = triangles.len();
        if mesh.triangles.iter().flatten().any(|v| *v as usize >= mesh.positions.len()) {
            continue;
        }
        for index in 0..mesh.triangles.len() as u32 {
            triangles.extend(Triangle::new(mesh, surface, index));
        }
        let own = &mut triangles[first..];
        let mean = own.iter().map(|t: &Triangle| t.size).sum::<f64>() / own.len() as f64;
        own.iter_mut().for_each(|t| t.size = mean);
    }
    let welded: Vec<_> = surfaces.iter().map(|s| weld(&s.positions)).collect();
    let corners_of = |t: &Triangle| {
        surfaces[t.surface as usize].triangles[t.index as usize]
            .map(|v| welded[t.surface as usize][v as usize])
    };
    let joined = |t: &Triangle, u: &Triangle| {
        let other = corners_of(u);
        t.surface == u.surface && corners_of(t).iter().any(|v| other.contains(v))
    };
    let mut topologies: Vec<Option<Topology>> = surfaces.iter().map(|_| None).collect();
    let mut found = Vec::new();
    let all: Vec<u32> = (0..triangles.len() as u32).collect();
    near::pairs(
        &all,
        |i| triangles[i as usize].corners,
        |i, j| {
            let [t, u] = [i.min(j), i.max(j)].map(|i| &triangles[i as usize]);
            if !joined(t, u)
                && let Some(meeting) = Meeting::of(t, u)
            {
                found.extend(meeting.segment(surfaces, &mut topologies));
            }
            ControlFlow::Continue(())
        },
    );
    let name = |s: &CrossingSegment| (s.surfaces, s.triangles);
    found.sort_by_key(name);
    // Those along edges are told of by the triangles on both sides.
    found.dedup_by_key(|s| name(s));
    found
}

/// A triangle with an area.
struct Triangle {
    corners: [Vec3; 3],
    normal: Vec3,
    /// Mean of the longest edges of the surface's triangles.
    size: f64,
    surface: u32,
    index: u32,
}

impl Triangle {
    fn new(mesh: &Mesh, surface: u32, index: u32) -> Option<Self> {
        let corners = mesh.triangle(index);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        let size = f64::max((b - a).length(), f64::max((c - b).length(), (a - c).length()));
        let usable = corners.iter().all(|p| is_usable(*p)) && normal.is_finite();
        usable.then_some(Self { corners, normal, size, surface, index })
    }

    /// Distances of another's corners from the plane; 0 of those that count as on it.
    fn sides_of(&self, other: &Self) -> [f64; 3] {
        let near = ON * f64::min(self.size, other.size);
        other.corners.map(|p| {
            let side = self.normal.dot(p - self.corners[0]);
            if Real::abs(side) > near { side } else { 0.0 }
        })
    }

    /// The part of the line in which its plane meets another, by the sides of its corners.
    fn chord(&self, sides: [f64; 3]) -> Option<Chord> {
        let on: Vec<usize> = (0..3).filter(|k| sides[*k] == 0.0).collect();
        let off = |sign: f64| sides.iter().any(|s| s * sign > 0.0);
        match (off(1.0) && off(-1.0), &on[..]) {
            (true, _) => {
                let corners = on.iter().map(|k| self.corners[*k]);
                let between = (0..3).map(|k| [k, (k + 1) % 3]).filter(|k| {
                    let [a, b] = k.map(|k| sides[k]);
                    a * b < 0.0
                });
                let cuts = between.map(|[i, j]| {
                    let [a, b] = [i, j].map(|k| self.corners[k]);
                    a + (b - a) * (sides[i] / (sides[i] - sides[j]))
                });
                let mut ends = corners.chain(cuts);
                Some(Chord { ends: [ends.next()?, ends.next()?], beside: None })
            }
            // An edge lies in the plane.
            (false, [i, j]) => {
                let corner = 3 - i - j;
                let ends = [*i, *j].map(|k| self.corners[k]);
                Some(Chord { ends, beside: Some((corner, sides[corner])) })
            }
            _ => None,
        }
    }
}

/// Where a triangle meets a plane.
struct Chord {
    ends: [Vec3; 2],
    /// Where that is an edge of it, the corner opposite, and how far it is from the plane.
    beside: Option<(usize, f64)>,
}

/// Two triangles whose planes and areas meet.
struct Meeting<'a> {
    triangles: [&'a Triangle; 2],
    chords: [Chord; 2],
    ends: [Vec3; 2],
}

impl<'a> Meeting<'a> {
    fn of(t: &'a Triangle, u: &'a Triangle) -> Option<Self> {
        let along = t.normal.cross(u.normal);
        let sine = along.length();
        if sine < PARALLEL {
            return None;
        }
        let along = along / sine;
        let chords = [t.chord(u.sides_of(t))?, u.chord(t.sides_of(u))?];
        let from = chords[0].ends[0];
        let [first, second] = [0, 1].map(|k| {
            let [a, b] = chords[k].ends.map(|p| along.dot(p - from));
            [f64::min(a, b), f64::max(a, b)]
        });
        let (low, high) = (f64::max(first[0], second[0]), f64::min(first[1], second[1]));
        let ends = [low, high].map(|s| from + along * s);
        (high - low > ON * f64::min(t.size, u.size)).then_some(Self {
            triangles: [t, u],
            chords,
            ends,
        })
    }

    /// The segment, if both surfaces go on beyond it.
    fn segment(
        &self,
        surfaces: &[&Mesh],
        topologies: &mut [Option<Topology>],
    ) -> Option<CrossingSegment> {
        let [a, b] = self.ends;
        let tangent = (b - a).normalize();
        let mut sides = [None; 2];
        for ((side, t), chord) in sides.iter_mut().zip(self.triangles).zip(&self.chords) {
            let across = t.normal.cross(tangent);
            let Some((corner, apart)) = chord.beside else {
                *side = Some(([t.index; 2], [across, -across]));
                continue;
            };
            let into = |p: Vec3| (p - a).reject(tangent).normalize();
            let mesh = surfaces[t.surface as usize];
            let topology = topologies[t.surface as usize].get_or_insert_with(|| Topology::of(mesh));
            let edge = topology.face_edges[t.index as usize][(corner + 1) % 3];
            let edge = topology.edges.get(edge as usize)?;
            let k = edge.faces.iter().position(|f| *f != t.index)?;
            let (next, opposite) = (edge.faces[k], edge.opposite[k]);
            if next == NONE || !edge.faces.contains(&t.index) {
                return None;
            }
            let opposite = mesh.positions[opposite as usize];
            let other = self.triangles.iter().find(|u| !core::ptr::eq(**u, t))?;
            let beyond = other.normal.dot(opposite - other.corners[0]);
            if beyond * apart >= 0.0 || Real::abs(beyond) <= ON * f64::min(t.size, other.size) {
                return None;
            }
            let mut both = [(t.index, into(t.corners[corner])), (next, into(opposite))];
            both.sort_unstable_by_key(|(triangle, _)| *triangle);
            *side = Some((both.map(|(triangle, _)| triangle), both.map(|(_, across)| across)));
        }
        // In the same order, whichever of two neighbours tells of it.
        let of = |k: usize| sides[k].map(|(t, across)| (self.triangles[k].surface, t, across));
        let mut both = [of(0)?, of(1)?];
        both.sort_unstable_by_key(|(surface, triangles, _)| (*surface, *triangles));
        Some(CrossingSegment {
            ends: self.ends,
            surfaces: both.map(|(surface, ..)| surface),
            triangles: both.map(|(_, triangles, _)| triangles),
            across: both.map(|(.., across)| across),
        })
    }
}
