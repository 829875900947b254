//! What a ray that [turns](crate::derivative::velocity::RayTurn) owes to the material points that turn it.

use drt_math::{Rgb, RgbVec, Vec3};

use crate::derivative::adjoint::chain::send_index;
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::derivative::velocity::{
    ChainPart, Mover, RayTurn, ShadowPart, ShadowTurn, TurnPart, TurningRay, Weight,
};
use crate::model::emitter::EmitterGradient;
use crate::sampling::trace::Arrival;
use crate::world::lights::{LightKind, LightSample};
use crate::world::vertex::{MaterialPoint, Matter, SurfacePoint, Vertex};

/// How a ray turns.
#[derive(Clone, Copy)]
pub(super) struct RayMotion<'a> {
    pub(super) turn: &'a RayTurn,
    pub(super) parts: &'a [TurnPart],
    /// From past smooth surfaces.
    pub(super) chain: &'a [ChainPart],
    /// Of shadows.
    pub(super) shadows: &'a [ShadowPart],
    /// That which casts them, or which the chain is connected to.
    pub(super) light: Option<&'a LightSample>,
}

/// The ray that found the surface point `end` of an arrival; the `eye` is the viewer where it is the camera's.
pub(super) fn found_ray<'a>(
    recorded: &RecordedPath<'a>,
    arrival: &Arrival,
    eye: &'a Vertex,
    end: &'a SurfacePoint,
) -> TurningRay<'a> {
    let parent = arrival.parent as usize;
    TurningRay {
        viewer: recorded.record.nodes[parent].vertex().unwrap_or(eye),
        moves: recorded.velocities.moves(parent),
        of_camera: (parent == 0).then_some(recorded.record.camera_ray),
        dir: arrival.dir,
        distance: arrival.distance,
        end: Some(end),
        emission_alone: false,
        tangent_plane: None,
    }
}

impl RayMotion<'_> {
    /// Sends the sensitivity `turned` to the rate of the ray's unit direction `dir`, and a `weight` of light that multiplies the
    /// divergence of the rate; returns what the velocity of the ray's origin is to lose.
    pub(super) fn send<S: AdjointSink>(
        &self,
        dir: Vec3,
        turned: &RgbVec,
        weight: Rgb,
        sink: &mut S,
    ) -> RgbVec {
        let across = turned.map(|g| g.reject(dir));
        let mut origin = RgbVec::ZERO;
        for part in self.parts {
            let g = across.map(|g| part.rate.transpose_mul(g)) + weight.outer(part.divergence);
            // Where surfaces intersect two parts share the origin: each loses its velocity from that of its own point.
            let place = part.matter.map_or(g, |matter| g.map(|g| matter.pull(g)));
            if let Some(matter) = part.matter {
                send_to(matter.point, SurfaceAdjoint::of_place(place), sink);
            }
            origin += place;
        }
        for part in self.chain {
            let g = across.map(|g| part.rate.transpose_mul(g)) + weight.outer(part.divergence);
            match part.mover {
                Mover::Viewer => origin -= g,
                Mover::Place(matter) => {
                    let g = g.map(|g| matter.pull(g));
                    send_to(matter.point, SurfaceAdjoint::of_place(g), sink);
                }
                Mover::Index(bsdf) => send_index(bsdf, g.dot(Vec3::X), sink),
                Mover::Lamp => {
                    if let Some(light) = self.light {
                        send_to_light(light, &g, sink);
                    }
                }
                Mover::Normal(point) => {
                    send_to(point, SurfaceAdjoint { ns: g, ..SurfaceAdjoint::default() }, sink);
                }
            }
        }
        if let (Some(shadow), Some(light)) = (&self.turn.shadow, self.light) {
            origin += self.send_shadow(shadow, light, &across, weight, sink);
        }
        origin
    }

    fn send_shadow<S: AdjointSink>(
        &self,
        shadow: &ShadowTurn,
        light: &LightSample,
        across: &RgbVec,
        weight: Rgb,
        sink: &mut S,
    ) -> RgbVec {
        let at = &shadow.at;
        let projected = across.map(|g| at.project(g)) + weight.outer(at.projection_divergence());
        // Of a summand of v.
        let by = |share: &Weight| {
            let along = at.project(share.gradient);
            projected * share.value + weight.outer(along)
        };
        for part in self.shadows {
            let place = by(&part.share).map(|g| part.matter.pull(g));
            send_to(part.matter.point, SurfaceAdjoint::of_place(place), sink);
        }
        if sink.active().emitters[light.emitter] {
            send_to_light(light, &by(&shadow.by_light), sink);
        }
        let (lift, lift_divergence) = at.lift();
        let Weight { value, gradient } = shadow.weight;
        let lifted =
            across.dot(lift) * value + weight * (gradient.dot(lift) + value * lift_divergence);
        let u = lifted.outer(at.normal);
        let n = (weight * value).outer(at.lift_by_normal(lift));
        send_to(at.matter, SurfaceAdjoint { u, n, ..SurfaceAdjoint::default() }, sink);
        let inv = 1.0 / at.distance;
        let rate =
            gradient * inv + at.inv_distance_gradient() * value - at.dir * (2.0 * value * inv);
        *across * (value * inv) + weight.outer(rate)
    }
}

fn send_to<S: AdjointSink>(point: MaterialPoint, adjoint: SurfaceAdjoint, sink: &mut S) {
    if sink.active().moves(&Matter::Surface(point)) {
        sink.surface(&point, &adjoint);
    }
}

/// To the position of a light, or its direction.
fn send_to_light<S: AdjointSink>(light: &LightSample, g: &RgbVec, sink: &mut S) {
    let mut gradients = [EmitterGradient::default(); 3];
    for (gradient, g) in gradients.iter_mut().zip([g.r, g.g, g.b]) {
        match light.kind {
            LightKind::Direction => gradient.direction = g.reject(light.w),
            _ => gradient.position = g,
        }
    }
    sink.emitter(light.emitter, &gradients);
}
