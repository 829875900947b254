//! Edges seen from the vertices of a path (2019 paper, Algorithm 2).

use drt_math::{Rgb, Vec3};

use super::difference::{Side, Sight};
use super::{AT_REST, Chosen, Look, Radiative};
use crate::transport::record::PathRecord;
use crate::transport::trace::Endpoint;
use crate::transport::{MaterialPoint, Tracer, Vertex, World};

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
        if !(recorded.carried || self.moving.is_some()) {
            return None;
        }
        tracer.counters.boundary_samples += 1;
        let chosen = self.look(tracer.world, vertex, wo, recorded.carried, look)?;
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
    /// stands still an edge at rest only does before something that moves and is grazed.
    fn look(
        &self,
        world: &World,
        vertex: &Vertex,
        wo: Vec3,
        carried: bool,
        look: &Look,
    ) -> Option<Chosen<'_>> {
        let all = self.all.as_ref()?;
        let Some(moving) = self.moving.as_ref().filter(|_| !carried) else {
            return all.sample(world, &self.jumps, vertex, wo, look);
        };
        if !self.at_rest {
            return moving.sample(world, &self.jumps, vertex, wo, look);
        }
        let (mut look, at_rest) = (*look, look.way < AT_REST);
        let (views, other) = if at_rest { (all, moving) } else { (moving, all) };
        let chance = if at_rest { AT_REST } else { 1.0 - AT_REST };
        look.way = if at_rest { look.way } else { look.way - AT_REST } / chance;
        let chosen = views.sample(world, &self.jumps, vertex, wo, &look)?;
        let density =
            chance / chosen.inv_pdf + (1.0 - chance) * other.density(world, vertex, wo, &chosen);
        Some(Chosen { inv_pdf: 1.0 / density, ..chosen })
    }

    /// Chooses a vertex that can see an edge change, in proportion to what passes it.
    fn choose_vertex(
        &self,
        tracer: &Tracer<'_>,
        record: &PathRecord,
        mut u: f64,
    ) -> Option<(usize, f64)> {
        let (mut total, mut chosen) = (0.0, None);
        for (k, node) in record.nodes.iter().enumerate().skip(1) {
            let choice = if node.carried { &self.all } else { &self.moving };
            let Some(arrival) = node.arrival.as_ref().filter(|_| choice.is_some()) else {
                continue;
            };
            if k as u32 >= tracer.max_segments {
                break;
            }
            let Some(vertex) = node.vertex() else { continue };
            let Some((_, theta)) = scattering_vertex(vertex, &arrival.end, arrival.throughput)
            else {
                continue;
            };
            let weight = theta.max_abs();
            if weight == 0.0 || !tracer.world.can_scatter(vertex) {
                continue;
            }
            total += weight;
            // One number serves all: what is left of it is uniform again.
            let chance = weight / total;
            if u < chance {
                chosen = Some((k, weight));
                u /= chance;
            } else {
                u = (u - chance) / (1.0 - chance);
            }
        }
        chosen.map(|(k, weight)| (k, weight / total))
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
