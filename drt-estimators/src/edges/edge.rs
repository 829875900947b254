//! Edges that can be silhouettes, and how points and directions on them are drawn (theory sheet
//! §4.3).

use alloc::vec::Vec;
use core::f64::consts::PI;

use drt_geom::{EdgeClass, NONE, Topology};
use drt_math::{CdfTable, Real, Rng, Vec3, fm, warp};

use crate::model::error::Error;
use crate::world::vertex::MaterialPoint;
use crate::world::{SurroundingMedium, World};

/// An edge of a surface that blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    a: Vec3,
    b: Vec3,
    length: f64,
    /// Unit, from `a` to `b`.
    pub(crate) tangent: Vec3,
    /// The edge's faces in the soup; twice the same for an open edge.
    pub(crate) faces: [u32; 2],
    /// Unit, across the edge into each face; twice the same for an open edge.
    pub(crate) across: [Vec3; 2],
    /// Angle between the faces, 0 for an open edge.
    between: f64,
    pub(crate) shape: u32,
    /// The first face in its shape, and which of its corners are `a` and `b`.
    triangle: u32,
    corners: [u8; 2],
    /// Where segments that graze the edge run: before the faces, behind them, or on an open edge.
    side: GrazedSide,
    /// The medium in which they run, where that is the same all along the edge.
    medium: SurroundingMedium,
    /// Something is so near that the edge may rest on it.
    pub(crate) may_rest: bool,
}

/// The side of an edge's faces on which it can be grazed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GrazedSide {
    Front,
    Back,
    Unknown,
}

/// A point on an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgePoint<'a> {
    pub(crate) edge: &'a Edge,
    pub(crate) x: Vec3,
    /// The same point on the edge's first face.
    pub(crate) point: MaterialPoint,
    /// 1 over the density per length.
    pub(crate) inv_pdf: f64,
}

impl Edge {
    /// An edge between two `ends` of faces with the given corners `opposite` to it; `None` where it
    /// has no length or a face no area.
    pub(crate) fn new(
        ends: [Vec3; 2],
        opposite: [Vec3; 2],
        faces: [u32; 2],
        shape: u32,
        corners: [u8; 2],
        side: GrazedSide,
    ) -> Option<Self> {
        let [a, b] = ends;
        let length = (b - a).length();
        let tangent = (b - a) / length;
        let across = opposite.map(|c| (c - a).reject(tangent).normalize());
        let [h0, h1] = across;
        let usable = tangent.is_finite() && h0.is_finite() && h1.is_finite() && length > 0.0;
        let between = fm::atan2(h0.cross(h1).length(), h0.dot(h1));
        usable.then_some(Self {
            a,
            b,
            length,
            tangent,
            faces,
            across,
            between,
            shape,
            triangle: 0,
            corners,
            side,
            medium: SurroundingMedium::Varies,
            may_rest: false,
        })
    }

    /// Unit, from the edge in between its faces; `None` where they lie in one plane.
    pub(crate) fn inward(&self) -> Option<Vec3> {
        let sum = self.across[0] + self.across[1];
        (sum.length_squared() > 1e-8).then(|| sum.normalize())
    }

    /// Normals of the faces' planes. Directions that graze the edge with both faces on one side have
    /// products of the same sign with both.
    pub(crate) fn plane_normals(&self) -> [Vec3; 2] {
        self.across.map(|h| h.cross(self.tangent))
    }

    /// The unit normal of the plane of the edge and the unit direction `w`, towards the side where
    /// the faces lie; `None` unless all of them lie strictly on one side.
    pub(crate) fn occluded_side(&self, w: Vec3) -> Option<Vec3> {
        let n = self.tangent.cross(w);
        let length = n.length();
        let [s0, s1] = self.across.map(|h| h.dot(n));
        if s0 * s1 <= 0.0 || length < 1e-12 {
            return None;
        }
        Some(n * (s0.signum() / length))
    }

    /// A direction whose segments graze the edge, with its inverse solid-angle density. The polar
    /// angle θ around the edge has density ∝ sin² θ, which cancels the kernel's two sines; the
    /// azimuth is uniform over the valid wedges.
    pub(crate) fn sample_direction(&self, rng: &mut Rng) -> (Vec3, f64) {
        let theta = warp::sin_squared_polar(rng.next_f64());
        let free = PI - self.between;
        let u = 2.0 * rng.next_f64();
        let azimuth =
            if u < 1.0 { self.between + u * free } else { PI + self.between + (u - 1.0) * free };
        let (x, y) = self.frame();
        let ((sin, cos), (sin_phi, cos_phi)) = (fm::sin_cos(theta), fm::sin_cos(azimuth));
        let w = self.tangent * cos + (x * cos_phi + y * sin_phi) * sin;
        (w, self.inverse_density(theta, sin))
    }

    fn inverse_density(&self, theta: f64, sin: f64) -> f64 {
        2.0 * (PI - self.between) * sin / warp::sin_squared_polar_pdf(theta)
    }

    /// Solid-angle density of [`Edge::sample_direction`] at a valid direction.
    pub(crate) fn direction_pdf(&self, w: Vec3) -> f64 {
        let sin = self.tangent.cross(w).length();
        let theta = fm::atan2(sin, self.tangent.dot(w));
        1.0 / self.inverse_density(theta, sin)
    }

    /// The first face's direction, and the one a quarter turn towards the second.
    fn frame(&self) -> (Vec3, Vec3) {
        let [h0, h1] = self.across;
        let y = self.tangent.cross(h0);
        (h0, if y.dot(h1) < 0.0 { -y } else { y })
    }

    /// Its first end, and the vector to its second.
    pub(crate) fn line(&self) -> (Vec3, Vec3) {
        (self.a, self.b - self.a)
    }

    /// The number of each end, whatever their order, the same for edges that coincide.
    pub(crate) fn place(&self) -> [[u64; 3]; 2] {
        // Adding zero makes a zero positive.
        let [a, b] = [self.a, self.b].map(|p| p.to_array().map(|c| (c + 0.0).to_bits()));
        if a < b { [a, b] } else { [b, a] }
    }

    /// The faces with the angles around the edge at which they lie, measured from a first face of
    /// `other`, which has the same place.
    pub(crate) fn faces_around(&self, other: &Self) -> [(f64, u32, Vec3); 2] {
        let x = other.across[0];
        let y = other.tangent.cross(x);
        let angle = |h: Vec3| fm::atan2(h.dot(y), h.dot(x));
        [0, 1].map(|k| (angle(self.across[k]), self.faces[k], self.across[k]))
    }

    /// The same edge with the faces of others that coincide with it, of which only those at the ends
    /// of the wedge that holds them all decide what grazes the edge.
    pub(crate) fn among(&self, [first, second]: [(u32, Vec3); 2], between: f64) -> Self {
        // The faces of the edge itself stay what rays leave and velocities are taken from.
        let own = self.faces[0] != self.faces[1];
        let beside = if first.0 == self.faces[0] { second.0 } else { first.0 };
        let faces = if own { self.faces } else { [self.faces[0], beside] };
        let across = [first.1, second.1];
        Self { faces, across, between, side: GrazedSide::Unknown, ..*self }
    }

    /// The point at `u` of the way along the edge.
    pub(crate) fn point(&self, u: f64) -> (Vec3, MaterialPoint) {
        let mut bary = [0.0; 3];
        bary[self.corners[0] as usize] = 1.0 - u;
        bary[self.corners[1] as usize] = u;
        let at = drt_motion::SurfacePoint { triangle: self.triangle, bary: [bary[1], bary[2]] };
        (self.a * (1.0 - u) + self.b * u, MaterialPoint { shape: self.shape, at })
    }

    /// Looks up the medium around the edge where one answer holds for all of it; `around` is the one
    /// around its shape, as [`World::medium_around`] has it.
    pub(crate) fn settle_medium(&mut self, world: &World, around: SurroundingMedium) {
        let boundary = world.scene.shapes[self.shape as usize].boundary;
        self.medium = match (boundary, self.side) {
            (Some(b), GrazedSide::Front) => SurroundingMedium::Uniform(b.exterior),
            (Some(b), GrazedSide::Back) => SurroundingMedium::Uniform(b.interior),
            (Some(_), GrazedSide::Unknown) => SurroundingMedium::Varies,
            (None, _) => around,
        };
    }

    /// The medium in which segments graze the edge at `x`.
    pub(crate) fn medium(&self, world: &World, x: Vec3) -> Option<usize> {
        self.medium.at(world, x)
    }

    /// True when the edge can be a silhouette seen along `w`.
    pub(crate) fn faces_split(&self, w: Vec3) -> bool {
        self.occluded_side(w).is_some()
    }
}

/// Edges with probabilities.
#[derive(Debug)]
pub(crate) struct EdgeTable {
    pub(crate) edges: Vec<Edge>,
    table: CdfTable,
}

impl EdgeTable {
    /// Takes the edges that matter and have positive weight; `None` when there are none.
    pub(crate) fn new(
        edges: &[Edge],
        matters: impl Fn(&Edge) -> bool,
        weight: impl Fn(&Edge) -> f64,
    ) -> Result<Option<Self>, Error> {
        let kept: Vec<(Edge, f64)> =
            edges.iter().map(|e| (*e, weight(e))).filter(|(e, w)| *w > 0.0 && matters(e)).collect();
        if kept.is_empty() {
            return Ok(None);
        }
        let weights: Vec<f64> = kept.iter().map(|(_, w)| *w).collect();
        let table = CdfTable::new(&weights).map_err(|e| Error::Element {
            element: "edges".into(),
            reason: alloc::format!("cannot be sampled: {e}"),
        })?;
        Ok(Some(Self { edges: kept.into_iter().map(|(e, _)| e).collect(), table }))
    }

    /// Weight of an edge for directions drawn on it: its length times the angle that is free.
    pub(crate) fn general_weight(e: &Edge) -> f64 {
        e.length * (PI - e.between)
    }

    pub(crate) fn sample(&self, rng: &mut Rng) -> EdgePoint<'_> {
        // Monotone: one number places the point among all edges.
        let s = self.table.sample(rng.next_f64());
        let edge = &self.edges[s.index];
        let (x, point) = edge.point(s.residual);
        EdgePoint { edge, x, point, inv_pdf: edge.length / s.pmf }
    }
}

/// Weight of an edge seen from a point: the angle it subtends, 0 when it is no silhouette anywhere
/// along it.
pub(crate) fn seen_from(e: &Edge, eye: Vec3) -> f64 {
    let (da, db) = (e.a - eye, e.b - eye);
    if ![da, db, (da + db) * 0.5].into_iter().any(|d| e.faces_split(d.normalize())) {
        return 0.0;
    }
    fm::atan2(da.cross(db).length(), da.dot(db))
}

/// Weight of an edge seen along a direction: its projected length.
pub(crate) fn seen_along(e: &Edge, w: Vec3) -> f64 {
    if e.faces_split(w) { e.length * e.tangent.cross(w).length() } else { 0.0 }
}

/// Every edge of the scene that can be grazed, and the number of all edges.
pub(crate) fn collect(world: &World) -> (Vec<Edge>, u64) {
    let mut edges = Vec::new();
    let mut all = 0;
    for (i, shape) in world.scene.shapes.iter().enumerate() {
        if world.is_null(i as u32) {
            continue;
        }
        let mesh = &shape.mesh;
        let topology = Topology::of(mesh);
        all += topology.edges.len() as u64;
        for e in &topology.edges {
            if e.class == EdgeClass::Flat
                || (e.class != EdgeClass::Boundary && !e.can_be_silhouette())
            {
                continue;
            }
            let [a, b] = e.vertices.map(|v| mesh.positions[v as usize]);
            let face = mesh.triangles[e.faces[0] as usize];
            let corner = |v: u32| face.iter().position(|c| *c == v);
            let (Some(ca), Some(cb)) = (corner(e.vertices[0]), corner(e.vertices[1])) else {
                continue;
            };
            let second = usize::from(e.faces[1] != NONE);
            let opposite = [0, second].map(|k| mesh.positions[e.opposite[k] as usize]);
            let faces = [0, second].map(|k| world.prim_of(i, e.faces[k]));
            let side = match e.class {
                EdgeClass::Convex => GrazedSide::Front,
                EdgeClass::Concave => GrazedSide::Back,
                _ => GrazedSide::Unknown,
            };
            let corners = [ca as u8, cb as u8];
            let edge = Edge::new([a, b], opposite, faces, i as u32, corners, side);
            edges.extend(edge.map(|edge| Edge { triangle: e.faces[0], ..edge }));
        }
    }
    (edges, all)
}

/// Sine of the angle between an edge and a direction.
pub(crate) fn sine(e: &Edge, w: Vec3) -> f64 {
    let c = e.tangent.dot(w);
    Real::sqrt(f64::max(0.0, 1.0 - c * c))
}
