//! Edges seen from the vertices of a path (2019 paper, Algorithm 2).

use core::ops::Range;

use drt_geom::edges::tree::TreeScratch;
use drt_math::{Rgb, Vec3};

use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::velocity::EdgeMatter;
use crate::sampling::record::Role;
use crate::sampling::trace::Endpoint;
use crate::sampling::trace::Tracer;
use crate::terms::edge_queries::difference::{EdgeView, SideRadiance};
use crate::terms::edge_queries::edge_sampler::{EdgeSampler, viewpoint};
use crate::terms::edge_queries::reservoir::Choice;
use crate::terms::edge_queries::{AT_REST, BY_THROUGHPUT, CARRIED, EdgeQuery, SeenEdges};
use crate::world::World;
use crate::world::vertex::{Matter, Vertex};

/// An edge's contribution to a path: a sum of speeds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeContribution {
    /// The vertex that sees the edge.
    pub(crate) node: usize,
    /// Along which the vertex has its speed.
    pub(crate) n: Vec3,
    /// What multiplies that.
    pub(crate) viewer: Rgb,
    /// Velocities of the edge and of what is seen on its two sides, dotted with vectors, and what multiplies these.
    pub(crate) matter: [Option<(Matter, Vec3, Rgb)>; 4],
}

/// What a query is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum QueryTarget {
    /// An edge that moves, or any from a vertex that does.
    Moving,
    /// An edge at rest, before something that moves and has a blend weight, from a vertex at rest.
    Resting,
}

/// A point of an edge and the vertex that sees it.
pub(super) struct EdgeSample<'a> {
    node: usize,
    view: EdgeView<'a>,
    along: f64,
    /// Of what the two sides differ by, all but the transmittance.
    pub(super) weight: Rgb,
    /// Segments beyond the edge.
    longest: u32,
}

impl EdgeSample<'_> {
    /// What is seen.
    fn follow(self, tracer: &mut Tracer<'_>) -> Option<EdgeContribution> {
        let Self { node, view, along, weight, longest } = self;
        let weight = weight * view.open(tracer)?;
        let [minus, plus] = view.sides(tracer, longest);
        let lights = [weight * minus.light, weight * -plus.light];
        let held = [lights[0] * minus.blend, lights[1] * plus.blend];
        let [edge, viewer] = [lights, held].map(|[a, b]| a + b);
        let n = view.sides.n;
        let of = |side: &SideRadiance, held: Rgb| side.matter.map(|m| (m, n, -held));
        let of_edge = |m: EdgeMatter| (Matter::Surface(m.point), m.pull(n), edge);
        let (own, other) = view.discontinuity.edge.matter(tracer.world, along);
        let matter =
            [Some(of_edge(own)), other.map(of_edge), of(&minus, held[0]), of(&plus, held[1])];
        let dark = lights.iter().all(|l| l.is_zero());
        (!dark).then_some(EdgeContribution { node, n, viewer: viewer - edge, matter })
    }
}

impl SeenEdges {
    /// Takes one sample: one of the path's vertices, an edge that it sees.
    pub(crate) fn edge(
        &self,
        tracer: &mut Tracer<'_>,
        path: &RecordedPath<'_>,
        query: &EdgeQuery,
        options: &mut TreeScratch,
    ) -> Option<EdgeContribution> {
        let nodes = 1..path.record.nodes.len();
        let (sought, likely, query) = self.sought(path, nodes, query);
        let (node, chance) = self.choose_vertex(tracer, path, sought, query.vertex, options)?;
        self.sample_from(tracer, path, node, sought, likely * chance, &query, options)?
            .follow(tracer)
    }

    /// The same from a given vertex.
    pub(crate) fn edge_from(
        &self,
        tracer: &mut Tracer<'_>,
        path: &RecordedPath<'_>,
        node: usize,
        query: &EdgeQuery,
        options: &mut TreeScratch,
    ) -> Option<EdgeContribution> {
        let (sought, likely, query) = self.sought(path, node..node + 1, query);
        self.sample_from(tracer, path, node, sought, likely, &query, options)?.follow(tracer)
    }

    /// What a query from one of some vertices is for, its probability, and what is left of its numbers.
    fn sought(
        &self,
        path: &RecordedPath<'_>,
        mut nodes: Range<usize>,
        query: &EdgeQuery,
    ) -> (QueryTarget, f64, EdgeQuery) {
        if self.resting.is_none() || nodes.all(|n| path.velocities.moves(n)) {
            return (QueryTarget::Moving, 1.0, *query);
        }
        let (sought, from, likely) = match query.way < AT_REST {
            true => (QueryTarget::Resting, 0.0, AT_REST),
            false => (QueryTarget::Moving, AT_REST, 1.0 - AT_REST),
        };
        (sought, likely, EdgeQuery { way: (query.way - from) / likely, ..*query })
    }

    /// A query from a vertex for what is `sought`, which both have a given `chance`.
    #[allow(clippy::too_many_arguments)]
    fn sample_from<'a>(
        &'a self,
        tracer: &mut Tracer<'_>,
        path: &RecordedPath<'a>,
        node: usize,
        sought: QueryTarget,
        chance: f64,
        query: &EdgeQuery,
        options: &mut TreeScratch,
    ) -> Option<EdgeSample<'a>> {
        let (record, moves) = (&path.record, path.velocities.moves(node));
        let recorded = &record.nodes[node];
        let arrival =
            recorded.arrival.as_ref().filter(|_| !matches!(recorded.role, Role::Probe))?;
        let (vertex, theta) =
            scattering_vertex(recorded.vertex()?, &arrival.end, arrival.throughput)?;
        let longest = tracer.max_segments.checked_sub(record.segments(node) + 1)?;
        let wo = -arrival.dir;
        tracer.counters.boundary_samples += 1;
        let views = self.views(moves, sought)?;
        let around = &viewpoint(tracer.world, vertex, wo);
        let chosen = views.sample(&self.discontinuities, around, query, options)?;
        let view = EdgeView::new(tracer, self, chosen.discontinuity, chosen.along, vertex)?;
        let scattering = tracer.world.scattering(vertex)?;
        let f = scattering.eval(wo, -view.w);
        if f.is_zero() {
            return None;
        }
        let kernel = view.sides.sine / (view.distance * view.distance);
        let weight = theta * f * (kernel * chosen.inv_pdf / chance);
        Some(EdgeSample { node, view, along: chosen.along, weight, longest })
    }

    /// What edges a vertex may sample.
    fn views(&self, moves: bool, sought: QueryTarget) -> Option<&EdgeSampler> {
        match (sought, moves) {
            (QueryTarget::Moving, true) => self.all.as_ref(),
            (QueryTarget::Moving, false) => self.moving.as_ref(),
            (QueryTarget::Resting, true) => None,
            (QueryTarget::Resting, false) => self.resting.as_ref(),
        }
    }

    /// An estimate of how much edges matter to a vertex; 0 only if they do not.
    fn amount(
        &self,
        world: &World,
        options: &mut TreeScratch,
        vertex: &Vertex,
        wo: Vec3,
        moves: bool,
        sought: QueryTarget,
    ) -> f64 {
        let Some(views) = self.views(moves, sought) else { return 0.0 };
        let amount = views.amount(&viewpoint(world, vertex, wo), options);
        if moves { CARRIED * amount } else { amount }
    }

    /// Chooses a vertex that can see an edge change: mostly in proportion to what passes it and to how
    /// much there is to see from it, at times to the former alone.
    fn choose_vertex(
        &self,
        tracer: &mut Tracer<'_>,
        path: &RecordedPath<'_>,
        sought: QueryTarget,
        u: f64,
        options: &mut TreeScratch,
    ) -> Option<(usize, f64)> {
        let mut choice = Choice::new(u, BY_THROUGHPUT);
        for (k, node) in path.record.nodes.iter().enumerate().skip(1) {
            let arrival = node.arrival.as_ref().filter(|_| !matches!(node.role, Role::Probe));
            let Some(arrival) = arrival else { continue };
            if k as u32 >= tracer.max_segments {
                break;
            }
            let Some(vertex) = node.vertex() else { continue };
            let Some((_, theta)) = scattering_vertex(vertex, &arrival.end, arrival.throughput)
            else {
                continue;
            };
            let theta = theta.max_abs();
            if theta == 0.0 || !tracer.world.can_scatter(vertex) {
                continue;
            }
            let amount = self.amount(
                tracer.world,
                options,
                vertex,
                -arrival.dir,
                path.velocities.moves(k),
                sought,
            );
            if amount > 0.0 {
                choice.offer(k, [theta, theta * amount]);
            }
        }
        choice.made()
    }
}

/// A vertex with the throughput to its scattering function.
fn scattering_vertex<'v>(
    vertex: &'v Vertex,
    end: &Endpoint,
    throughput: Rgb,
) -> Option<(&'v Vertex, Rgb)> {
    match end {
        Endpoint::Surface(_) => Some((vertex, throughput)),
        Endpoint::Volume(_, c) => Some((vertex, throughput * c.sigma_s())),
        Endpoint::Environment => None,
    }
}
