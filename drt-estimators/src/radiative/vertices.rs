//! Edges seen from the vertices of a path (2019 paper, Algorithm 2).

use drt_math::{Rgb, Vec3};

use super::difference::Sight;
use super::{Look, Radiative};
use crate::transport::record::PathRecord;
use crate::transport::trace::Endpoint;
use crate::transport::{MaterialPoint, Tracer, Vertex};

/// An edge's contribution to a path: `value` times the speed along `n` of the edge point less that of
/// the vertex that sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edged {
    pub(crate) node: usize,
    pub(crate) point: MaterialPoint,
    pub(crate) n: Vec3,
    pub(crate) value: Rgb,
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
        let recorded = &record.nodes[node];
        let arrival = recorded.arrival.as_ref()?;
        let (vertex, theta) =
            scattering_vertex(recorded.vertex()?, &arrival.end, arrival.throughput)?;
        let longest = tracer.max_segments.checked_sub(record.segments(node) + 1)?;
        let choice = if recorded.carried { &self.all } else { &self.moving };
        tracer.counters.boundary_samples += 1;
        let (world, wo) = (tracer.world, -arrival.dir);
        let chosen = choice.as_ref()?.sample(world, &self.jumps, vertex, wo, look)?;
        let sight = Sight::new(tracer, &self.jumps, chosen.jump, chosen.along, vertex.x)?;
        let scattering = tracer.world.scattering(vertex)?;
        let f = scattering.eval(wo, -sight.w);
        if f.is_zero() {
            return None;
        }
        let tau = sight.open(tracer)?;
        let difference = sight.difference(tracer, longest);
        let kernel = sight.sides.sine / (sight.distance * sight.distance);
        let value = theta * f * tau * difference * (kernel * chosen.inv_pdf / chance);
        let (_, point) = chosen.jump.point(chosen.along);
        (!value.is_zero()).then_some(Edged { node, point, n: sight.sides.n, value })
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
