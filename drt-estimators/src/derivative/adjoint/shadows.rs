//! Connections to points and directions whose shadows move.

use alloc::vec::Vec;

use crate::derivative::adjoint::connections::NextEvent;
use crate::derivative::adjoint::turning::{RayMotion, found_ray};
use crate::derivative::adjoint::{Behind, Differentiator, NodeMotion};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::derivative::velocity::Found;
use crate::world::vertex::Vertex;

impl Differentiator<'_> {
    /// A connection by which the vertex of a node has a velocity of its own, with the shadows of the light; false where it does not.
    /// Then what it gives to the node is differentiated alone, as if of a path that ends there.
    pub(super) fn connect_with_shadows<S: AdjointSink>(
        &mut self,
        recorded: &RecordedPath<'_>,
        k: usize,
        vertex: &Vertex,
        event: &NextEvent<'_>,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) -> bool {
        let RecordedPath { record, velocities, .. } = *recorded;
        let (world, field, light) = (self.world, velocities.field(), &event.c.light);
        let Some(arrival) = record.nodes[k].arrival.as_ref() else { return false };
        let fits = light.point().is_none() && !self.edges_at_rest;
        let Some(s) = vertex.surface().filter(|_| fits) else { return false };
        let eye = world.eye_at(record.origin);
        let viewer = record.nodes[arrival.parent as usize].vertex();
        let ray = found_ray(recorded, arrival, &eye, s);
        let moves = event.moving || sink.active().moving_emitters[light.emitter];
        let mut parts = core::mem::take(&mut self.with_shadows);
        parts.clear();
        let turn = field.turn_with_shadows(world, &ray, light, moves, &mut parts);
        self.probe.turning_edges += (parts.edges.len() + parts.shadows.len()) as u64;
        if let Some(turn) = &turn {
            let found = Found {
                camera_ray: record.camera_ray,
                viewer,
                ray_moves: true,
                turn: Some(turn),
                arrival,
                hits: &[],
            };
            let mut auxiliary = Vec::new();
            let velocity = field.vertex(world, &found, &mut self.probe, &mut auxiliary);
            let weight = velocity.blend.weight;
            let behind = event.behind.map(|b| Behind { weight, ..b });
            let event = NextEvent { behind, moving: true, arrives: true, ..*event };
            let light = Some(light);
            let ray =
                RayMotion { turn, chain: &[], parts: &parts.edges, shadows: &parts.shadows, light };
            let motion = NodeMotion { velocity: &velocity, auxiliary: &auxiliary, ray: Some(ray) };
            let received = event.c.f * event.c.rest();
            self.alone(k, |sweep| {
                let here = &mut SurfaceAdjoint::default();
                sweep.connect(recorded, -arrival.dir, vertex, &event, here, before, sink);
                sweep.arrive(recorded, k, &motion, received, here, before, sink);
            });
        }
        self.with_shadows = parts;
        turn.is_some()
    }
}
