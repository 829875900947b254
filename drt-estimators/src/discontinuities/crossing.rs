//! Lines along which surfaces pass through each other.
//!
//! No triangle ends there, but what is seen of either does: the line is an edge with four faces around it. Seen from
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
use core::f64::consts::{PI, TAU};

use drt_geom::edges::Wedge;
use drt_geom::{CrossingSegment, Mesh, crossing_segments};
use drt_math::{Vec3, fm};

use crate::discontinuities::contact::Contact;
use crate::discontinuities::crossed::{Crossed, Sheets};
use crate::discontinuities::edge::{Edge, EdgePoint};
use crate::world::World;
use crate::world::vertex::{Kind, Vertex};

/// The part of an edge's length from which on it is that line, where it lies along one.
const WHOLE: f64 = 0.999;

/// Of a line's length: how far from it what leaves a face next to it starts.
const BESIDE: f64 = 1e-6;

/// The lines, of surfaces that scatter or block. Edges of meshes that are such lines go.
pub(crate) fn crossings(world: &World, edges: &mut Vec<Edge>) -> Vec<Edge> {
    let shapes: Vec<u32> =
        (0..world.scene.shapes.len() as u32).filter(|s| !world.is_null(*s)).collect();
    let meshes: Vec<&Mesh> =
        shapes.iter().map(|s| &*world.scene.shapes[*s as usize].mesh).collect();
    let found = crossing_segments(&meshes);
    let shape = |s: &CrossingSegment, k: usize| shapes[s.surfaces[k] as usize];
    let prims = |s: &CrossingSegment, k: usize| {
        s.triangles[k].map(|t| world.prim_of(shape(s, k) as usize, t))
    };
    let mut covered: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for s in &found {
        for k in [0, 1] {
            *covered.entry(prims(s, k)).or_default() += (s.ends[1] - s.ends[0]).length();
        }
    }
    edges.retain(|e| {
        let [a, b] = e.wedge.faces;
        let length = covered.get(&[a.min(b), a.max(b)]).copied();
        a == b || length.is_none_or(|length| length < WHOLE * e.wedge.length)
    });
    let line = |s: &CrossingSegment| {
        let opposite = s.across[0].map(|across| s.ends[0] + across);
        let wedge = Wedge::new(s.ends, opposite, prims(s, 0));
        let by = Crossed { shape: shape(s, 1), faces: prims(s, 1) };
        wedge.map(|wedge| Edge::crossing(wedge, shape(s, 0), by))
    };
    found.iter().filter_map(line).collect()
}

impl Contact {
    /// A face that ends for a viewer at such a line, where the others stand on it: by its number among the [`Sheets`], and
    /// a vector to the viewer's side of it.
    pub(crate) fn at_crossing(
        world: &World,
        at: &EdgePoint<'_>,
        sheets: &Sheets,
        number: usize,
        towards: Vec3,
    ) -> Self {
        let tangent = at.edge.wedge.tangent;
        let (face, side) = sheets[number];
        let normal = side.cross(tangent);
        let up = if normal.dot(towards) < 0.0 { -normal } else { normal };
        let angle = |across: Vec3| {
            let angle = fm::atan2(across.dot(up), across.dot(side));
            if angle < 0.0 { angle + TAU } else { angle }
        };
        let others = (0..).zip(sheets).filter(|(k, _)| *k != number);
        let first = others.map(|(_, (_, across))| angle(*across)).fold(PI, f64::min);
        let beside = at.x + side * (BESIDE * at.edge.wedge.length);
        let (point, x) = world.point_near(face, beside);
        // Half-way to what stands there.
        let (sine, cosine) = fm::sin_cos(0.5 * first);
        let between = side * cosine + up * sine;
        let medium = at.edge.medium(world, at.x + between * (BESIDE * at.edge.wedge.length));
        let vertex = Vertex { x, medium, kind: Kind::Surface(point) };
        Self::with_floor(up, side, [first, PI], [Some(vertex), None])
    }
}
