//! Lines along which surfaces intersect.
//!
//! No triangle ends there, but what is seen of either surface does: the line is an edge with four faces around it. Seen from
//! anywhere a face ends on either side, as at a crease, and it [moves](crate::derivative::velocity::EdgeMatter) against the matter
//! of both surfaces.
//!
//! In material form each of the faces is a domain that ends at the line, for paths on one side of it and for those on the other:
//! with f what paths carry through a point of a face next to the line on one of its sides, and V the speed of the line
//! into the face, relative to its matter,
//!
//! ```text
//! d/dθ ∫ f dA = - Σ over faces and sides ∫ V f dl + ...,
//! ```
//!
//! as where an edge [rests](crate::discontinuities::contact) on a surface. Rays that start there see up to the next face around the line.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use drt_geom::edges::Wedge;
use drt_geom::{CrossingSegment, Mesh, crossing_segments};

use crate::discontinuities::edge::Edge;
use crate::discontinuities::intersection_faces::IntersectingFaces;
use crate::world::World;

/// AlongEdges of an edge that are shorter, over the edge's length, are left out.
const SHORT: f64 = 1e-6;

/// What lies along edges, by their faces in ascending order.
type AlongEdges = BTreeMap<[u32; 2], Vec<CrossingSegment>>;

/// Edges of meshes where these are on no other surface, and the lines along which surfaces that scatter or block intersect.
pub(super) fn intersections(world: &World, mut edges: Vec<Edge>) -> (Vec<Edge>, Vec<Edge>) {
    let shapes: Vec<u32> =
        (0..world.scene.shapes.len() as u32).filter(|s| !world.is_null(*s)).collect();
    let meshes: Vec<&Mesh> =
        shapes.iter().map(|s| &*world.scene.shapes[*s as usize].mesh).collect();
    let found = crossing_segments(&meshes);
    let shape = |s: &CrossingSegment, k: usize| shapes[s.surfaces[k] as usize];
    let prims = |s: &CrossingSegment, k: usize| {
        s.triangles[k].map(|t| world.prim_of(shape(s, k) as usize, t))
    };
    let mut along_edges = AlongEdges::new();
    for s in &found {
        for [a, b] in [0, 1].map(|k| prims(s, k)).into_iter().filter(|[a, b]| a != b) {
            along_edges.entry([a.min(b), a.max(b)]).or_default().push(*s);
        }
    }
    if !along_edges.is_empty() {
        edges = edges.iter().flat_map(|e| rest(e, &along_edges)).collect();
    }
    let lines = found.iter().filter_map(|s| {
        let opposite = s.across[0].map(|across| s.ends[0] + across);
        let wedge = Wedge::new(s.ends, opposite, prims(s, 0))?;
        let by = IntersectingFaces { shape: shape(s, 1), faces: prims(s, 1) };
        Some(Edge::intersection(wedge, shape(s, 0), by))
    });
    (edges, lines.collect())
}

/// The parts of an edge that lie on no other surface.
fn rest(edge: &Edge, along_edges: &AlongEdges) -> Vec<Edge> {
    let [a, b] = edge.wedge.faces;
    let Some(segments) = along_edges.get(&[a.min(b), a.max(b)]) else {
        return alloc::vec![*edge];
    };
    let place = |s: &CrossingSegment| {
        let [a, b] =
            s.ends.map(|x| (x - edge.wedge.ends[0]).dot(edge.wedge.tangent) / edge.wedge.length);
        [f64::min(a, b), f64::max(a, b)]
    };
    let mut covered: Vec<[f64; 2]> = segments.iter().map(place).collect();
    covered.push([1.0, 1.0]);
    covered.sort_unstable_by(|[a, _], [b, _]| a.total_cmp(b));
    let (mut parts, mut from) = (Vec::new(), 0.0);
    for [low, high] in covered {
        if low - from > SHORT {
            parts.push(edge.part([from, low]));
        }
        from = f64::max(from, high);
    }
    parts
}
