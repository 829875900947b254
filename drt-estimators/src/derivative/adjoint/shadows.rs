//! Connections to points and directions whose shadows move.

use alloc::vec;
use alloc::vec::Vec;

use drt_math::Rgb;

use crate::derivative::adjoint::connections::NextEvent;
use crate::derivative::adjoint::turning::{RayMotion, found_ray};
use crate::derivative::adjoint::{Behind, Differentiator, Local, NodeMotion};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::derivative::velocity::{Found, Lamp, Link, RayBehind, VertexVelocity};
use crate::world::vertex::{SurfacePoint, Vertex};

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
        if record.nodes[arrival.parent as usize].single {
            return self.connect_past_chain(recorded, k, (vertex, s), event, before, sink);
        }
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
                sweep.arrive(recorded, k, &motion, received, Rgb::ZERO, here, before, sink);
            });
        }
        self.with_shadows = parts;
        turn.is_some()
    }

    /// A connection of a vertex that was found past smooth surfaces: it turns the ray that started their chain, so that all of the chain is
    /// swept alone. False where nothing turns the ray.
    #[cold]
    fn connect_past_chain<S: AdjointSink>(
        &mut self,
        recorded: &RecordedPath<'_>,
        k: usize,
        (vertex, s): (&Vertex, &SurfacePoint),
        event: &NextEvent<'_>,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) -> bool {
        let RecordedPath { record, velocities, .. } = *recorded;
        let (world, light) = (self.world, &event.c.light);
        let Some(arrival) = record.nodes[k].arrival.as_ref() else { return false };
        let moves = sink.active().moving_emitters[light.emitter];
        let Some(lamp) = Lamp::of(light, moves) else { return false };
        let (eye, parent) = (world.eye_at(record.origin), arrival.parent as usize);
        let links = vec![Link::connected(world, *s, lamp)];
        let rays = vec![
            RayBehind { dir: light.w, distance: light.distance, end: None },
            RayBehind { dir: arrival.dir, distance: arrival.distance, end: Some(*s) },
        ];
        let chain = velocities.chained(world, record, &eye, parent, links, rays);
        let Some((first, chain)) = chain else { return false };
        let (mut parts, mut chained) = (Vec::new(), Vec::new());
        let turn = velocities.field().turn_with_chain(world, &chain, &mut parts, &mut chained);
        let Some(turn) = &turn else { return false };
        self.probe.turning_edges += (parts.len() + chained.len()) as u64;
        let (parts, chain, light) = (&parts[..], &chained[..], Some(light));
        let ray = RayMotion { turn, chain, parts, shadows: &[], light };
        // What was collected for the chain's nodes goes with the turn that their path has without the connection.
        let nodes: Vec<usize> = core::iter::successors(Some(k), |node| {
            let arrival = record.nodes[*node].arrival.as_ref()?;
            (*node != first).then_some(arrival.parent as usize)
        })
        .collect();
        let ordinary: Vec<(Local, SurfaceAdjoint)> = nodes
            .iter()
            .map(|&node| {
                let end = before.get_mut(node).map(core::mem::take).unwrap_or_default();
                (core::mem::take(&mut self.locals[node]), end)
            })
            .collect();
        let event = NextEvent { moving: true, arrives: true, ..*event };
        let own = &mut SurfaceAdjoint::default();
        self.connect(recorded, -arrival.dir, vertex, &event, own, before, sink);
        for &node in &nodes {
            let velocity = VertexVelocity { moves: true, ..velocities.of(node).clone() };
            let ray = (node == first).then_some(ray);
            let motion = NodeMotion { velocity: &velocity, auxiliary: &[], ray };
            if node == k {
                let received = event.c.f * event.c.rest();
                self.arrive(recorded, node, &motion, received, Rgb::ZERO, own, before, sink);
                continue;
            }
            let at = &record.nodes[node];
            let received = at.value * at.inv_pdf * self.locals[node].children;
            let Some((here, before)) = before[..=node].split_last_mut() else { continue };
            self.arrive(recorded, node, &motion, received, Rgb::ZERO, here, before, sink);
        }
        for (node, (local, end)) in nodes.into_iter().zip(ordinary) {
            let own = core::mem::replace(&mut self.locals[node], local);
            self.locals[node].incoming += own.incoming;
            if let Some(before) = before.get_mut(node) {
                *before = end;
            }
        }
        true
    }
}
