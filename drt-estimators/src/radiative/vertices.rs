//! Edges seen from the vertices of a path (2019 paper, Algorithm 2).

use drt_math::{Rgb, Vec3};

use super::choice::Choice;
use super::difference::{Side, Sight};
use super::views::{Views, viewpoint};
use super::{AT_REST, BY_THROUGHPUT, CARRIED, Chosen, Look, Radiative};
use crate::transport::record::PathRecord;
use crate::transport::trace::Endpoint;
use crate::transport::{MaterialPoint, Tracer, Vertex};

/// An edge's contribution to a path: a sum of speeds along `n`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edged {
    /// The vertex that sees the edge.
    pub(crate) node: usize,
    pub(crate) n: Vec3,
    /// What multiplies the speed of the vertex.
    pub(crate) viewer: Rgb,
    /// What multiplies those of the edge, and of what is seen on its two sides.
    pub(crate) matter: [Option<(MaterialPoint, Rgb)>; 3],
}

impl Radiative {
    /// Takes one sample: one of the path's vertices, an edge that it sees.
    pub(crate) fn edge(
        &self,
        tracer: &mut Tracer<'_>,
        record: &PathRecord,
        look: &Look,
    ) -> Option<Edged> {
        let (node, chance) = self.choose_vertex(tracer, record, look.vertex)?;
        self.edge_from(tracer, record, node, chance, look)
    }

    /// The same from a given vertex, chosen with a given `chance`.
    pub(crate) fn edge_from(
        &self,
        tracer: &mut Tracer<'_>,
        record: &PathRecord,
        node: usize,
        chance: f64,
        look: &Look,
    ) -> Option<Edged> {
        let recorded = &record.nodes[node];
        let arrival = recorded.arrival.as_ref()?;
        let (vertex, theta) =
            scattering_vertex(recorded.vertex()?, &arrival.end, arrival.throughput)?;
        let longest = tracer.max_segments.checked_sub(record.segments(node) + 1)?;
        let wo = -arrival.dir;
        tracer.counters.boundary_samples += 1;
        let chosen = self.look(tracer, vertex, wo, recorded.carried, look)?;
        let sight = Sight::new(tracer, &self.jumps, chosen.jump, chosen.along, vertex)?;
        let scattering = tracer.world.scattering(vertex)?;
        let f = scattering.eval(wo, -sight.w);
        if f.is_zero() {
            return None;
        }
        let tau = sight.open(tracer)?;
        let [minus, plus] = sight.sides(tracer, longest);
        let kernel = sight.sides.sine / (sight.distance * sight.distance);
        let weight = theta * f * tau * (kernel * chosen.inv_pdf / chance);
        let (_, point) = chosen.jump.point(chosen.along);
        let lights = [weight * minus.light, weight * -plus.light];
        let held = [lights[0] * minus.hold, lights[1] * plus.hold];
        let [edge, viewer] = [lights, held].map(|[a, b]| a + b);
        let of = |side: &Side, held: Rgb| side.matter.map(|m| (m, -held));
        let matter = [Some((point, edge)), of(&minus, held[0]), of(&plus, held[1])];
        let dark = lights.iter().all(|l| l.is_zero());
        (!dark).then_some(Edged { node, n: sight.sides.n, viewer: viewer - edge, matter })
    }

    /// Chooses a point on an edge to look at. From a vertex that moves every edge counts; from one that
    /// stands still an edge at rest only does before something that moves and is held.
    fn look(
        &self,
        tracer: &mut Tracer<'_>,
        vertex: &Vertex,
        wo: Vec3,
        carried: bool,
        look: &Look,
    ) -> Option<Chosen<'_>> {
        let Tracer { world, options, .. } = tracer;
        let around = &viewpoint(world, vertex, wo);
        if carried {
            return self.all.as_ref()?.sample(&self.jumps, around, look, options);
        }
        let seen = |views: &&Views| self.chambers.in_sight(world, &views.among, vertex);
        let moving = self.moving.as_ref().filter(seen);
        let resting = self.resting.as_ref().filter(seen);
        let resting = resting.filter(|v| v.amount(around, options) > 0.0);
        let (Some(moving), Some(resting)) = (moving, resting) else {
            return moving.or(resting)?.sample(&self.jumps, around, look, options);
        };
        // No edge is in both.
        let (mut look, at_rest) = (*look, look.way < AT_REST);
        let (views, from, chance) =
            if at_rest { (resting, 0.0, AT_REST) } else { (moving, AT_REST, 1.0 - AT_REST) };
        look.way = (look.way - from) / chance;
        let chosen = views.sample(&self.jumps, around, &look, options)?;
        Some(Chosen { inv_pdf: chosen.inv_pdf / chance, ..chosen })
    }

    /// An estimate of how much edges matter to a vertex; 0 only if they do not.
    fn amount(&self, tracer: &mut Tracer<'_>, vertex: &Vertex, wo: Vec3, carried: bool) -> f64 {
        let Tracer { world, options, .. } = tracer;
        let around = viewpoint(world, vertex, wo);
        let mut of = |views: &Option<Views>| {
            let seen = |v: &&Views| carried || self.chambers.in_sight(world, &v.among, vertex);
            views.as_ref().filter(seen).map_or(0.0, |v| v.amount(&around, options))
        };
        if carried {
            CARRIED * of(&self.all)
        } else {
            of(&self.moving) + AT_REST * of(&self.resting)
        }
    }

    /// Chooses a vertex that can see an edge change: mostly in proportion to what passes it and to how
    /// much there is to see from it, at times to the former alone.
    fn choose_vertex(
        &self,
        tracer: &mut Tracer<'_>,
        record: &PathRecord,
        u: f64,
    ) -> Option<(usize, f64)> {
        let mut choice = Choice::new(u, BY_THROUGHPUT);
        for (k, node) in record.nodes.iter().enumerate().skip(1) {
            let Some(arrival) = node.arrival.as_ref() else { continue };
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
            let amount = self.amount(tracer, vertex, -arrival.dir, node.carried);
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
