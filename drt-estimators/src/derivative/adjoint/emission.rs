//! What a surface emits, where the ray that found it turns otherwise for that than for what the surface scatters.
//!
//! Emission that is the same everywhere on a shape jumps only where the shape ends, as it is seen, while what it scatters jumps at
//! creases between its facets, too. Rays that turn with those have a large divergence between them, which what is emitted would be
//! multiplied by in vain: on a lamp of many triangles that would be nearly all of the noise. A path's value is a sum, each summand
//! of which may be differentiated along a velocity of its own.

use alloc::vec::Vec;

use drt_math::Rgb;

use crate::derivative::adjoint::turning::{RayMotion, found_ray};
use crate::derivative::adjoint::{Differentiator, NodeMotion};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::derivative::velocity::{Found, TurningRay};
use crate::world::vertex::SurfacePoint;

impl Differentiator<'_> {
    /// Differentiates what the surface `point` of a node emits as if of a path that ends there; false where the motion of the node
    /// serves for that as well.
    pub(super) fn emit_apart<S: AdjointSink>(
        &mut self,
        recorded: &RecordedPath<'_>,
        k: usize,
        point: &SurfacePoint,
        emitted: Rgb,
        before: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) -> bool {
        let RecordedPath { record, velocities, .. } = *recorded;
        let (world, field) = (self.world, velocities.field());
        if self.edges_at_rest || emitted.is_zero() || !field.emission_turns_apart(point) {
            return false;
        }
        let eye = world.eye_at(record.origin);
        let Some(arrival) = record.nodes[k].arrival.as_ref() else { return false };
        // Past a smooth surface it is the chain's first ray that turns.
        if record.nodes[arrival.parent as usize].single {
            return false;
        }
        let ray = found_ray(recorded, arrival, &eye, point);
        let ray = TurningRay { emission_alone: true, ..ray };
        let mut parts = core::mem::take(&mut self.parts);
        parts.clear();
        let turn = field.turn(world, &ray, &mut self.probe, &mut parts);
        self.probe.turning_edges += parts.len() as u64;
        // Edges that turn the ray for one of both may be too far behind the surface for the other.
        if turn.is_none() && velocities.of(k).turn.is_none() {
            self.parts = parts;
            return false;
        }
        let found = Found {
            camera_ray: record.camera_ray,
            viewer: record.nodes[arrival.parent as usize].vertex(),
            ray_moves: ray.moves || turn.is_some(),
            turn: turn.as_ref(),
            arrival,
            hits: &[],
        };
        let mut auxiliary = Vec::new();
        let velocity = &field.vertex(world, &found, &mut self.probe, &mut auxiliary);
        let ray = turn.as_ref().map(|turn| RayMotion {
            turn,
            chain: &[],
            parts: &parts,
            shadows: &[],
            light: None,
        });
        let motion = NodeMotion { velocity, auxiliary: &auxiliary, ray };
        self.alone(k, |sweep| {
            let here = &mut SurfaceAdjoint::default();
            sweep.arrive(recorded, k, &motion, emitted, Rgb::ZERO, here, before, sink);
        });
        self.parts = parts;
        true
    }

    /// Does something as if nothing had been collected for a node, of which then only what reaches it counts.
    pub(super) fn alone(&mut self, k: usize, work: impl FnOnce(&mut Self)) {
        let ordinary = core::mem::take(&mut self.locals[k]);
        work(self);
        let own = core::mem::replace(&mut self.locals[k], ordinary);
        self.locals[k].incoming += own.incoming;
    }
}
