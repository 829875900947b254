//! Next-event connections: what their factors owe.

use drt_math::{Rgb, Vec3};

use crate::derivative::adjoint::emitters::{LightEnd, light_moves};
use crate::derivative::adjoint::segment::Stretch;
use crate::derivative::adjoint::{Behind, Differentiator, send_material};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::sampling::trace::Connection;
use crate::world::vertex::Vertex;
use crate::world::{Crossing, World};

/// A next-event connection.
#[derive(Clone, Copy)]
pub(super) struct NextEvent<'a> {
    pub(super) c: &'a Connection,
    pub(super) crossings: &'a [Crossing],
    /// What multiplies it.
    pub(super) theta: Rgb,
    pub(super) behind: Option<Behind>,
    /// The vertex moves.
    pub(super) moving: bool,
    /// Or the one before.
    pub(super) arrives: bool,
}

impl Differentiator<'_> {
    /// Next-event connections of a vertex: returns their sum, without the scattering coefficient.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn connections<S: AdjointSink>(
        &mut self,
        recorded: &RecordedPath<'_>,
        k: usize,
        vertex: &Vertex,
        theta: Rgb,
        here: &mut SurfaceAdjoint,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) -> Rgb {
        let mut sum = Rgb::ZERO;
        let RecordedPath { record, velocities, lit, .. } = *recorded;
        let node = &record.nodes[k];
        let Some(arrival) = &node.arrival else { return sum };
        let behind = self.behind(recorded, k);
        let moving = velocities.moves(k);
        let arrives = moving || velocities.moves(arrival.parent as usize);
        for (c, crossings) in &record.connections[node.connections.clone()] {
            if !lit.by_sample(&c.light) {
                continue;
            }
            let crossings = &record.crossings[crossings.clone()];
            let event = NextEvent { c, crossings, theta, behind, moving, arrives };
            if !self.connect_with_shadows(recorded, k, vertex, &event, before, sink) {
                sum += c.f * c.rest();
                self.connect(recorded, -arrival.dir, vertex, &event, here, before, sink);
            }
        }
        sum
    }

    /// One of them.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn connect<S: AdjointSink>(
        &mut self,
        recorded: &RecordedPath<'_>,
        wo: Vec3,
        vertex: &Vertex,
        event: &NextEvent<'_>,
        here: &mut SurfaceAdjoint,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) {
        let NextEvent { c, crossings, theta, behind, moving, arrives } = *event;
        let (light, world) = (&c.light, self.world);
        let field = recorded.velocities.field();
        let motion = self.light_motion(vertex, moving, light, field, sink.active());
        let turns = arrives || motion.is_some() || light_moves(light, sink.active());
        let rest = theta * c.rest();
        let to_wi =
            self.scattering(vertex, wo, light.w, None, rest, behind, turns, here, before, sink);
        let per_value = theta * c.f * c.transport;
        if world.any_straight && light.is_delta() {
            straight_through(world, crossings, light.w, rest * c.f, sink);
        }
        let path = Stretch {
            start: vertex.x,
            dir: light.w,
            length: light.distance,
            medium: c.start_medium,
            crossings,
        };
        let motion = motion.as_ref();
        let end = LightEnd { near_moves: moving, light, to_wi, motion };
        self.light_end(&path, &end, per_value, here, sink);
    }
}

/// Sends what the light of a connection, as much as `value`, owes to the materials that it goes straight through.
#[cold]
fn straight_through<S: AdjointSink>(
    world: &World,
    crossings: &[Crossing],
    dir: Vec3,
    value: Rgb,
    sink: &mut S,
) {
    for Crossing { point, .. } in crossings {
        let bsdf = world.scene.shapes[point.shape as usize].bsdf;
        if !sink.active().bsdfs[bsdf] || world.is_null(point.shape) {
            continue;
        }
        let at = world.texture_point(point);
        if let Some(part) = world.scene.bsdfs[bsdf].item.specular(Some(&at), -dir, dir, point.ns) {
            send_material(world, point, &part.params, value.div_or_zero(part.value), sink);
        }
    }
}
