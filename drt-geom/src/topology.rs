use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use drt_math::{Vec3, fm};

use crate::mesh::direction;
use crate::{Mesh, NONE, weld};

/// Dihedral angles nearer to pi than this, in radians, count as flat: what coordinates written
/// with six or seven digits leave of a plane. A silhouette edge of this angle is seen from a
/// fraction 1e-6 / pi of all directions, so nothing measurable is lost.
const FLAT: f64 = 1e-6;

/// Height of a face over its longest edge below which its corners are on one line.
const NO_WIDTH: f64 = 1e-12;

/// What the faces around an edge look like, seen from outside the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum EdgeClass {
    /// One face only: the rim of an open mesh.
    Boundary,
    /// A ridge: the outside angle is above pi.
    Convex,
    /// A valley: the outside angle is below pi.
    Concave,
    /// Two faces in one plane: never a silhouette.
    Flat,
    /// Three faces or more. [`Edge::faces`] are the two on either side of the widest gap.
    NonManifold,
}

/// An edge of the mesh after welding, listed once whatever the number of its faces.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Edge {
    /// Mesh vertices at its ends, in the order in which `faces[0]` runs through them.
    pub vertices: [u32; 2],
    /// The two faces; the second is [`NONE`] at a boundary.
    pub faces: [u32; 2],
    /// The mesh vertex of each face that is not on the edge; [`NONE`] where there is no face.
    pub opposite: [u32; 2],
    /// How the faces meet.
    pub class: EdgeClass,
    /// The widest angle between neighbouring faces around the edge, in radians: 2 pi at a boundary,
    /// pi for a flat edge, more for any edge that can be a silhouette. A direction grazes the edge
    /// with every face on one side for a fraction `(widest_angle - pi) / pi` of the planes through it.
    pub widest_angle: f64,
}

impl Edge {
    /// Whether some direction grazes the edge with all its faces on one side.
    ///
    /// For such an edge that is so exactly where the two [`faces`](Edge::faces) lie on one side of
    /// the plane through edge and direction, also where there are more than two faces: the others
    /// lie between those two.
    #[must_use]
    pub fn can_be_silhouette(&self) -> bool {
        self.widest_angle > PI + FLAT
    }
}

/// How the triangles of a mesh hang together, seen on welded positions.
///
/// Corners at equal positions are one vertex (see [`weld()`](crate::weld)). A face with two such
/// corners has no edges here; run [`Mesh::drop_degenerate`] first where that matters. A face whose corners are on one line
/// counts at an edge only where it closes the gap beside a single other face.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Topology {
    /// All edges, ordered by their welded vertices.
    pub edges: Vec<Edge>,
    /// For each face the edges (v0 v1), (v1 v2), (v2 v0), as indices into `edges`, or [`NONE`].
    pub face_edges: Vec<[u32; 3]>,
    /// For each mesh vertex the lowest one at the same position.
    pub welded: Vec<u32>,
    closed: bool,
    oriented: bool,
}

/// One side of one face, keyed by the welded ends of its edge.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    ends: [u32; 2],
    face: u32,
    corner: u32,
}

impl Topology {
    /// The topology of a mesh. Edges are classified by the positions of the faces' opposite
    /// vertices, whatever the shading normals say, and independently of the mesh's scale.
    #[must_use]
    pub fn of(mesh: &Mesh) -> Self {
        let welded = weld(&mesh.positions);
        let mut sides = Vec::with_capacity(3 * mesh.triangles.len());
        for (face, t) in mesh.triangles.iter().enumerate() {
            let w = t.map(|v| welded[v as usize]);
            if w[0] != w[1] && w[1] != w[2] && w[2] != w[0] {
                for k in 0..3 {
                    let (a, b) = (w[k], w[(k + 1) % 3]);
                    let ends = [u32::min(a, b), u32::max(a, b)];
                    sides.push(HalfEdge { ends, face: face as u32, corner: k as u32 });
                }
            }
        }
        sides.sort_unstable();

        let mut topology = Self {
            edges: Vec::new(),
            face_edges: alloc::vec![[NONE; 3]; mesh.triangles.len()],
            welded,
            closed: !sides.is_empty(),
            oriented: true,
        };
        let mut broad = Vec::new();
        for around in sides.chunk_by(|a, b| a.ends == b.ends) {
            broad.clear();
            broad.extend(around.iter().filter(|s| has_area(mesh, s.face)).copied());
            let around = match broad.len() {
                0 => continue,
                1 => around,
                _ => &broad[..],
            };
            let index = topology.edges.len() as u32;
            for s in around {
                topology.face_edges[s.face as usize][s.corner as usize] = index;
            }
            let forward = around.iter().filter(|s| topology.runs_forward(mesh, s)).count();
            topology.closed &= around.len() % 2 == 0;
            topology.oriented &= around.len() == 1 || 2 * forward == around.len();
            topology.edges.push(edge(mesh, around));
        }
        topology
    }

    fn runs_forward(&self, mesh: &Mesh, s: &HalfEdge) -> bool {
        self.welded[mesh.triangles[s.face as usize][s.corner as usize] as usize] == s.ends[0]
    }

    /// True when every edge has an even number of faces, and there is a face: the mesh then
    /// separates an inside from an outside.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// True when at every inner edge as many faces run one way as the other: their normals then
    /// all point to the same side of the surface.
    #[must_use]
    pub fn is_consistently_oriented(&self) -> bool {
        self.oriented
    }
}

/// False where the corners of a face are on one line, to rounding.
fn has_area(mesh: &Mesh, face: u32) -> bool {
    let [a, b, c] = mesh.triangle(face);
    let [u, v, w] = [b - a, c - b, a - c];
    let longest = [u, v, w].into_iter().fold(0.0, |most, e| f64::max(most, e.length_squared()));
    u.cross(v).length() > NO_WIDTH * longest
}

/// The edge's ends and opposite vertex as one face sees them.
fn corners(mesh: &Mesh, s: &HalfEdge) -> [u32; 3] {
    let t = mesh.triangles[s.face as usize];
    [0, 1, 2].map(|j| t[(s.corner as usize + j) % 3])
}

fn edge(mesh: &Mesh, around: &[HalfEdge]) -> Edge {
    let [a, b, o] = corners(mesh, &around[0]);
    if around.len() == 1 {
        return Edge {
            vertices: [a, b],
            faces: [around[0].face, NONE],
            opposite: [o, NONE],
            class: EdgeClass::Boundary,
            widest_angle: TAU,
        };
    }
    let mut angles = angles_around(mesh, around);
    let pair = |i: usize, j: usize, class, widest_angle| {
        let [a, b, o] = corners(mesh, &around[i]);
        Edge {
            vertices: [a, b],
            faces: [around[i].face, around[j].face],
            opposite: [o, corners(mesh, &around[j])[2]],
            class,
            widest_angle,
        }
    };
    if let [_, (outside, _)] = angles[..] {
        let class = if (outside - PI).abs() <= FLAT {
            EdgeClass::Flat
        } else if outside > PI {
            EdgeClass::Convex
        } else {
            EdgeClass::Concave
        };
        return pair(0, 1, class, f64::max(outside, TAU - outside));
    }
    angles.sort_by(|x, y| x.0.total_cmp(&y.0));
    let gap = |i: usize| {
        let next = angles.get(i + 1).map_or(angles[0].0 + TAU, |n| n.0);
        next - angles[i].0
    };
    let widest = (0..angles.len()).fold(0, |best, i| if gap(i) > gap(best) { i } else { best });
    let (from, to) = (angles[widest].1, angles[(widest + 1) % angles.len()].1);
    pair(usize::min(from, to), usize::max(from, to), EdgeClass::NonManifold, gap(widest))
}

/// The angle at which each face leaves the edge, and its place in `around`: measured from the first
/// face through the side its normal points to, in [0, 2 pi). A face without width counts as the
/// flat continuation of the first.
fn angles_around(mesh: &Mesh, around: &[HalfEdge]) -> Vec<(f64, usize)> {
    let position = |v: u32| mesh.positions[v as usize];
    let [a, b, _] = corners(mesh, &around[0]);
    let along = direction(position(b) - position(a)).unwrap_or(Vec3::ZERO);
    let width =
        |s: &HalfEdge| direction((position(corners(mesh, s)[2]) - position(a)).reject(along));
    let Some(first) = width(&around[0]) else {
        return (0..around.len()).map(|i| (if i == 0 { 0.0 } else { PI }, i)).collect();
    };
    let outward = along.cross(first);
    let angle = |s: &HalfEdge| {
        let w = width(s)?;
        let phi = fm::atan2(w.dot(outward), w.dot(first));
        Some(if phi < 0.0 { phi + TAU } else { phi })
    };
    around
        .iter()
        .enumerate()
        .map(|(i, s)| (if i == 0 { 0.0 } else { angle(s).unwrap_or(PI) }, i))
        .collect()
}
