//! Edges that can be silhouettes, and how points on them are drawn (theory sheet §4.3).

use alloc::vec::Vec;
use core::f64::consts::PI;

use drt_geom::NONE;
use drt_geom::edges::{Coincident, Fan, Gap, Wedge, faces_around};
use drt_math::{CdfTable, Rng, Vec3};

use crate::derivative::sensitivity::VelocityTerm;
use crate::derivative::velocity::EdgeMatter;
use crate::discontinuities::intersection_faces::{IntersectingFaces, Sheets};
use crate::discontinuities::order::sort_by_likeness;
use crate::model::error::Error;
use crate::model::sensor::{Sensor, Viewpoint};
use crate::world::vertex::MaterialPoint;
use crate::world::{SurroundingMedium, World};

/// An edge of a surface that blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// By the scene's triangles: the edge with the faces that decide what grazes it.
    pub(crate) wedge: Wedge,
    pub(crate) shape: u32,
    /// The first face in its shape, and which of its corners are the edge's ends.
    triangle: u32,
    corners: [u8; 2],
    /// From where to where along the mesh's edge it goes.
    part: [f64; 2],
    /// What intersects its faces along it.
    intersects: Option<IntersectingFaces>,
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
    /// Of the way along the edge.
    pub(crate) along: f64,
    /// 1 over the density per length.
    pub(crate) inv_pdf: f64,
}

impl Edge {
    /// An edge of a face `triangle` of a shape, whose `corners` are the edge's ends.
    pub(super) fn new(
        wedge: Wedge,
        shape: u32,
        triangle: u32,
        corners: [u8; 2],
        side: GrazedSide,
    ) -> Self {
        let medium = SurroundingMedium::Varies;
        let (part, intersects, may_rest) = ([0.0, 1.0], None, false);
        Self { wedge, shape, triangle, corners, part, intersects, side, medium, may_rest }
    }

    /// A line along which others intersect the faces of a shape.
    pub(super) fn intersection(wedge: Wedge, shape: u32, by: IntersectingFaces) -> Self {
        let edge = Self::new(wedge, shape, NONE, [0; 2], GrazedSide::Unknown);
        Self { intersects: Some(by), ..edge }
    }

    /// A part of an edge of a mesh.
    pub(super) fn part(&self, [from, to]: [f64; 2]) -> Self {
        let ends = [from, to].map(|u| self.wedge.at(u));
        let wedge = Wedge { ends, length: self.wedge.length * (to - from), ..self.wedge };
        Self { wedge, part: [from, to], ..*self }
    }

    /// The faces around a line along which surfaces intersect; `None` of edges of a mesh.
    pub(crate) fn intersecting_sheets(&self, world: &World) -> Option<Sheets> {
        self.intersects.map(|by| by.sheets(world, &self.wedge))
    }

    /// True of a line along which surfaces intersect.
    pub(crate) fn is_intersection(&self) -> bool {
        self.intersects.is_some()
    }

    /// How large it is to a camera where it is a silhouette, in radians or in scene units; 0 where it is none.
    pub(super) fn silhouette_in_view(&self, camera: &Sensor) -> f64 {
        match camera.viewpoint() {
            Viewpoint::Infinity(forward) => self.wedge.projected_length(forward),
            Viewpoint::Point(eye) => self.wedge.subtended_angle(eye),
            Viewpoint::Lens { centre, radius } => self.wedge.most_subtended(centre, radius),
        }
    }

    /// How large it is to a camera, silhouette or not, in the same units.
    pub(super) fn size_in_view(&self, camera: &Sensor) -> f64 {
        match camera.viewpoint() {
            Viewpoint::Infinity(forward) => self.wedge.length * self.wedge.sine(forward),
            Viewpoint::Point(eye) => self.wedge.largest_size(eye, 0.0),
            Viewpoint::Lens { centre, radius } => self.wedge.largest_size(centre, radius),
        }
    }

    /// How much a boundary segment to a camera matters.
    pub(crate) fn in_view(&self, camera: &Sensor) -> f64 {
        if self.is_intersection() {
            self.size_in_view(camera)
        } else {
            self.silhouette_in_view(camera)
        }
    }

    /// The shapes with which it moves.
    pub(crate) fn shapes(&self) -> impl Iterator<Item = u32> + use<> {
        core::iter::once(self.shape).chain(self.intersects.map(|by| by.shape))
    }

    /// The same edge with the faces of others that coincide with it, of which only those beside the widest
    /// gap decide what grazes the edge.
    fn with_gap(&self, Gap { beside: [first, second], between }: Gap) -> Self {
        // The faces of the edge itself stay what rays leave and velocities are taken from.
        let [own, other] = self.wedge.faces;
        let beside = if first.face == own { second.face } else { first.face };
        let faces = [own, if own == other { beside } else { other }];
        let across = [first.across, second.across];
        let wedge = Wedge { faces, across, between, ..self.wedge };
        Self { wedge, side: GrazedSide::Unknown, ..*self }
    }

    /// How the point at `u` of the way along the edge moves: with matter of one point, or of two.
    pub(crate) fn matter(&self, world: &World, u: f64) -> (EdgeMatter, Option<EdgeMatter>) {
        if let Some(by) = self.intersects {
            let [own, other] = by.matter(world, &self.wedge, self.wedge.at(u));
            return (own, Some(other));
        }
        let [from, to] = self.part;
        let (u, mut bary) = (from + (to - from) * u, [0.0; 3]);
        bary[self.corners[0] as usize] = 1.0 - u;
        bary[self.corners[1] as usize] = u;
        let at = drt_motion::SurfacePoint { triangle: self.triangle, bary: [bary[1], bary[2]] };
        (EdgeMatter::of(MaterialPoint { shape: self.shape, at }), None)
    }

    /// The velocity of the point at `u` of the way along the edge, dotted with n.
    pub(crate) fn velocity_terms(
        &self,
        world: &World,
        u: f64,
        n: Vec3,
    ) -> impl Iterator<Item = VelocityTerm> + use<> {
        let (own, other) = self.matter(world, u);
        core::iter::once(own).chain(other).map(move |m| VelocityTerm::Surface(m.point, m.pull(n)))
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

    /// The medium in which segments graze the edge.
    pub(crate) fn surrounding(&self) -> SurroundingMedium {
        self.medium
    }

    /// The medium in which segments graze the edge at `x`, which lies on no interface.
    pub(crate) fn medium(&self, world: &World, x: Vec3) -> Option<usize> {
        self.medium.at(world, x)
    }
}

impl<'a> EdgePoint<'a> {
    /// The point at `along` of the way along an edge.
    pub(crate) fn new(edge: &'a Edge, along: f64, inv_pdf: f64) -> Self {
        Self { edge, x: edge.wedge.at(along), along, inv_pdf }
    }
}

/// Makes one of all edges at the same place: of one that `moves`, where there is one. Those at which
/// nothing can be hidden go.
pub(crate) fn merge_coincident(mut edges: Vec<Edge>, moves: impl Fn(&Edge) -> bool) -> Vec<Edge> {
    let mut stays: Vec<bool> = edges.iter().map(|_| true).collect();
    let coincident = Coincident::among(edges.iter().map(|e| &e.wedge));
    for same in coincident.groups().filter(|same| same.len() > 1) {
        let main = same.iter().copied().find(|i| moves(&edges[*i])).unwrap_or(same[0]);
        let edge = &edges[main].wedge;
        let faces = faces_around(edge, same.iter().map(|i| &edges[*i].wedge));
        let gap = Fan { edge, faces: &faces }.widest_gap();
        for i in same {
            stays[*i] = *i == main && gap.is_some();
        }
        if let Some(gap) = gap {
            edges[main] = edges[main].with_gap(gap);
        }
    }
    let mut stays = stays.into_iter();
    edges.retain(|_| stays.next() == Some(true));
    edges
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
        let mut kept: Vec<(Edge, f64)> =
            edges.iter().map(|e| (*e, weight(e))).filter(|(e, w)| *w > 0.0 && matters(e)).collect();
        sort_by_likeness(&mut kept, |(e, _)| &e.wedge);
        Self::of_sorted(kept)
    }

    /// Those of its edges that have positive weight, by another weight.
    pub(crate) fn reweighted(&self, weight: impl Fn(&Edge) -> f64) -> Result<Option<Self>, Error> {
        let weighted = self.edges.iter().map(|e| (*e, weight(e)));
        Self::of_sorted(weighted.filter(|(_, w)| *w > 0.0).collect())
    }

    fn of_sorted(kept: Vec<(Edge, f64)>) -> Result<Option<Self>, Error> {
        if kept.is_empty() {
            return Ok(None);
        }
        let weights: Vec<f64> = kept.iter().map(|(_, w)| *w).collect();
        let table = CdfTable::new(&weights)
            .map_err(|e| Error::Element { element: "edges".into(), reason: e.into() })?;
        Ok(Some(Self { edges: kept.into_iter().map(|(e, _)| e).collect(), table }))
    }

    /// Weight of an edge for directions drawn on it: its length times its silhouette angle.
    pub(crate) fn general_weight(e: &Edge) -> f64 {
        e.wedge.length * if e.is_intersection() { PI } else { e.wedge.silhouette_angle() }
    }

    pub(crate) fn sample(&self, rng: &mut Rng) -> EdgePoint<'_> {
        // Monotone: one number places the point among all edges.
        let s = self.table.sample(rng.next_f64());
        let edge = &self.edges[s.index];
        EdgePoint::new(edge, s.residual, edge.wedge.length / s.pmf)
    }
}
