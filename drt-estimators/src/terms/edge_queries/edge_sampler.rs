//! Sampling edges from a vertex: the [tree](drt_geom::edges::tree), asked in several ways at once.
//!
//! Radiance jumps most where a lamp is behind an edge. So some queries go towards the spheres around the
//! lamps, and the rest anywhere.
//!
//! An edge at rest matters to a vertex at rest only where the vertices of something that moves have a blend weight right
//! beside it: in the direction of a sphere around all that does, and no farther than its far side.

use alloc::vec::Vec;

use drt_geom::Aabb;
use drt_geom::edges::Lobes;
use drt_geom::edges::tree::{Draw, EdgeTree, MOST_WAYS, Segment, TreeScratch, Viewpoint, Way};
use drt_math::Vec3;

use crate::discontinuities::discontinuity_edge::{DiscontinuityEdge, DiscontinuityEdges};
use crate::terms::edge_queries::{Chosen, EdgeQuery};
use crate::world::World;
use crate::world::vertex::{Kind, Vertex};

/// The part of queries that go towards lamps.
const TOWARD_LAMPS: f64 = 0.5;

/// Lamps looked towards on purpose.
const MOST_LAMPS: usize = MOST_WAYS - 1;

/// A sphere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere {
    center: Vec3,
    radius: f64,
}

/// Edges to sample, and in which directions.
#[derive(Debug)]
pub(super) struct EdgeSampler {
    tree: EdgeTree,
    /// Indices of the edges that the tree's segments are.
    discontinuities: Vec<u32>,
    /// The part of queries that go towards some spheres, and these.
    share: f64,
    toward: Vec<Sphere>,
}

impl EdgeSampler {
    /// Of the edges that `matter`, in proportion to how much; `None` without any.
    pub(super) fn new(
        world: &World,
        discontinuities: &DiscontinuityEdges,
        matter: impl Fn(&DiscontinuityEdge) -> f64,
    ) -> Option<Self> {
        let weighed = (0..)
            .zip(&discontinuities.list)
            .map(|(i, discontinuity)| (i, discontinuity, matter(discontinuity)));
        let kept = weighed.filter(|(_, _, weight)| *weight > 0.0);
        let (indices, segments): (Vec<u32>, Vec<Segment>) = kept
            .map(|(i, discontinuity, weight)| (i, segment(discontinuities, discontinuity, weight)))
            .unzip();
        let tree = EdgeTree::new(&segments)?;
        let toward = lamps(world);
        let share = if toward.is_empty() { 0.0 } else { TOWARD_LAMPS };
        Some(Self { tree, discontinuities: indices, share, toward })
    }

    /// The same, looking only at what may be before some of the shapes.
    pub(super) fn before(self, world: &World, shapes: &[u32]) -> Self {
        let bounds = shapes.iter().map(|s| world.scene.shapes[*s as usize].mesh.bounds());
        let toward = bounds.reduce(|a, b| a.union(&b)).map(|b| Sphere::around(&b));
        Self { share: 1.0, toward: toward.into_iter().collect(), ..self }
    }

    /// An estimate of how much there is to see: an integral of scattering and edges.
    pub(super) fn amount(&self, around: &Viewpoint, options: &mut TreeScratch) -> f64 {
        let way = match &self.toward[..] {
            [all] if self.share == 1.0 => around.toward(1.0, all.center, all.radius),
            _ => Way::anywhere(1.0),
        };
        self.tree.amount(around, &way, options)
    }

    /// Draws a point of an edge that can be seen from a viewpoint.
    pub(super) fn sample<'a>(
        &self,
        discontinuities: &'a DiscontinuityEdges,
        around: &Viewpoint,
        query: &EdgeQuery,
        options: &mut TreeScratch,
    ) -> Option<Chosen<'a>> {
        let (mut ways, mut count) = ([Way::anywhere(1.0 - self.share); MOST_WAYS], 0);
        let each = self.share / self.toward.len().max(1) as f64;
        for (way, s) in ways.iter_mut().zip(&self.toward) {
            *way = around.toward(each, s.center, s.radius);
            count += 1;
        }
        count += usize::from(self.share < 1.0);
        let draw = Draw { way: query.way, point: query.point };
        let chosen = self.tree.sample(around, &ways[..count], &draw, options)?;
        let discontinuity = &discontinuities.list[self.discontinuities[chosen.edge] as usize];
        Some(Chosen { discontinuity, along: chosen.u, inv_pdf: chosen.inv_pdf })
    }
}

impl Sphere {
    fn around(b: &Aabb) -> Self {
        Self { center: b.center(), radius: 0.5 * (b.max - b.min).length() }
    }
}

/// How edges matter to a vertex that scatters light to `wo`.
pub(super) fn viewpoint(world: &World, vertex: &Vertex, wo: Vec3) -> Viewpoint {
    let normal = match &vertex.kind {
        Kind::Surface(s) => {
            let n = if s.ns.dot(wo) < 0.0 { -s.ns } else { s.ns };
            Some((n, world.bsdf_of(s.shape).is_transmissive()))
        }
        _ => None,
    };
    let lobes = world.scattering(vertex).map_or(Lobes::even(0.0), |s| s.lobes(wo));
    Viewpoint::new(vertex.x, normal).scattering(lobes)
}

fn segment(
    discontinuities: &DiscontinuityEdges,
    discontinuity: &DiscontinuityEdge,
    weight: f64,
) -> Segment {
    let [a, b] = discontinuity.edge.wedge.ends;
    let (faces, open) = match discontinuities.normals(discontinuity) {
        Some(normals) => (normals, false),
        // What is seen of three faces and more depends on where from.
        None => {
            let across = discontinuities.faces(discontinuity).map(|(_, across)| across).next();
            ([discontinuity.edge.wedge.tangent.cross(across.unwrap_or_default()); 2], true)
        }
    };
    let crease = discontinuity.crease.map(|crease| crease * weight);
    Segment { a, b, faces, open, discontinuity: weight, crease }
}

/// The spheres around the surfaces that emit most.
fn lamps(world: &World) -> Vec<Sphere> {
    let shapes = world.scene.shapes.iter().filter_map(|s| {
        let radiance = world.lights.area_radiance(s.emitter?);
        let sphere = Sphere::around(&s.mesh.bounds());
        Some((radiance.mean() * s.mesh.surface_area(), sphere))
    });
    let mut lamps: Vec<(f64, Sphere)> = shapes.collect();
    lamps.sort_by(|a, b| b.0.total_cmp(&a.0));
    lamps.into_iter().take(MOST_LAMPS).map(|(_, sphere)| sphere).collect()
}
