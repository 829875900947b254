//! The emitters' ends of a path: what a contribution owes to a light's strength, place, direction and
//! falloff.

use drt_math::{Rgb, RgbVec, Vec3};

use crate::derivative::adjoint::propagation::Propagated;
use crate::derivative::adjoint::segment::{Far, Stretch};
use crate::derivative::adjoint::turning::RayMotion;
use crate::derivative::adjoint::{Differentiator, turn};
use crate::derivative::sensitivity::{ActiveInputs, AdjointSink, SurfaceAdjoint, TextureUse};
use crate::derivative::velocity::{RayTurn, TurningRay, VelocityField, VertexVelocity};
use crate::model::emitter::{Emitter, EmitterGradient};
use crate::world::World;
use crate::world::lights::{Environment, LightKind, LightSample};
use crate::world::vertex::{Kind, SurfacePoint, Vertex};

/// The emitter's end of a connection.
pub(super) struct LightEnd<'a> {
    pub(super) near_moves: bool,
    pub(super) light: &'a LightSample,
    /// Sensitivity of scattering to the direction.
    pub(super) to_wi: Option<RgbVec>,
    pub(super) motion: Option<&'a LightMotion>,
}

/// How the emitter's end of a connection moves.
pub(super) struct LightMotion {
    /// Of a point on an area.
    end: Option<(Vertex, VertexVelocity)>,
    /// Of the ray to it.
    turn: Option<RayTurn>,
}

impl Differentiator<'_> {
    /// How the emitter's point of a connection moves, and how the ray to it turns; `None` where neither does, and of points and
    /// directions, whose rays turn with shadows.
    pub(super) fn light_motion(
        &mut self,
        viewer: &Vertex,
        near_moves: bool,
        light: &LightSample,
        field: &dyn VelocityField,
        active: &ActiveInputs,
    ) -> Option<LightMotion> {
        if light.is_delta() {
            return None;
        }
        let (dir, distance, end) = (light.w, light.distance, light.point());
        let ray = TurningRay {
            viewer,
            moves: near_moves,
            of_camera: None,
            dir,
            distance,
            end,
            emission_alone: true,
            tangent_plane: None,
        };
        let Self { world, parts, auxiliary, probe, .. } = self;
        parts.clear();
        auxiliary.clear();
        let turn = field.turn(world, &ray, probe, parts);
        probe.turning_edges += parts.len() as u64;
        let Some(s) = end else {
            return turn.is_some().then_some(LightMotion { end: None, turn });
        };
        let moves = near_moves || turn.is_some() || light_moves(light, active);
        if !(moves || field.looks_around()) {
            return None;
        }
        let end = Vertex { x: light.y, medium: None, kind: Kind::Surface(*s) };
        let mut velocity =
            field.light(world, viewer, &end, dir, distance, near_moves, probe, auxiliary);
        if let Some(turn) = &turn {
            velocity.blend = velocity.blend.and(turn.rest(distance));
        }
        if !moves && auxiliary.is_empty() {
            return None;
        }
        Some(LightMotion { end: Some((end, velocity)), turn })
    }

    /// Sensitivities at the emitter's end of a connection.
    pub(super) fn light_end<S: AdjointSink>(
        &mut self,
        path: &Stretch<'_>,
        end: &LightEnd<'_>,
        per_value: Rgb,
        here: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        let LightEnd { near_moves, light, to_wi, motion } = *end;
        let weight = per_value * light.value;
        let active = sink.active();
        let emitter = active.emitters[light.emitter];
        match &light.kind {
            LightKind::Area(point) => {
                let mut slide = RgbVec::ZERO;
                area(self.world, light.emitter, point, per_value, &mut slide, sink);
                let Some(LightMotion { end: Some((end, velocity)), turn: turn_of_ray }) = motion
                else {
                    self.segment(path, Far::Direction, false, weight, here, sink);
                    return;
                };
                let ray_moves = near_moves || turn_of_ray.is_some();
                let phi = velocity.blend.weight;
                let free = weight * (1.0 - phi);
                let mut turned = self.segment(path, Far::Direction, ray_moves, free, here, sink);
                let part = weight * phi;
                let slides = ray_moves || !velocity.auxiliary.is_empty();
                let mut lit = SurfaceAdjoint { slide, ..SurfaceAdjoint::default() };
                turned += self.material_end(path, end, slides, part, &mut lit, here, sink);
                if let Some(to_wi) = to_wi {
                    let g = turn(&(to_wi * phi), light.w, light.distance);
                    lit.u += g;
                    here.u -= g;
                    turned += to_wi;
                }
                if turn_of_ray.is_some() {
                    let own = SurfaceAdjoint { slide, ..SurfaceAdjoint::default() };
                    turned += self.landing(path, end, &own, weight);
                }
                let matter = core::mem::take(&mut lit.u);
                let auxiliary = &self.auxiliary[..];
                let at = Propagated { vertex: end, velocity, auxiliary, weight, matter };
                self.propagate(path, &at, &mut lit, here, sink);
                if let Some(turn) = turn_of_ray {
                    self.turn_to_light(turn, light, &turned, weight, here, sink);
                }
            }
            LightKind::Position => {
                let moving = near_moves || emitter;
                let far = Far::Position;
                let mut at_light = self.segment(path, far, moving, weight, here, sink);
                if moving && let Some(to_wi) = to_wi {
                    let g = turn(&to_wi, light.w, light.distance);
                    at_light += g;
                    here.u -= g;
                }
                self.intensity(path, light, per_value, at_light, here, sink);
            }
            LightKind::Environment => {
                let Some(environment) = self.world.lights.environment() else { return };
                surroundings(environment, light.w, per_value, sink);
                let turn = motion.and_then(|motion| motion.turn.as_ref());
                let moving = near_moves || turn.is_some();
                let mut turned = self.segment(path, Far::Direction, moving, weight, here, sink);
                if let Some(turn) = turn {
                    turned += environment.gradient(light.w) * per_value;
                    turned += to_wi.unwrap_or(RgbVec::ZERO);
                    self.turn_to_light(turn, light, &turned, weight, here, sink);
                }
            }
            LightKind::Direction => {
                let moving = near_moves || emitter;
                let turn = self.segment(path, Far::Direction, moving, weight, here, sink);
                if emitter {
                    direction(light, to_wi, turn, per_value, sink);
                }
            }
        }
    }

    /// Sends the sensitivity `turned` to the rate of the direction of the ray to an emitter, which turns like this.
    fn turn_to_light<S: AdjointSink>(
        &self,
        turn: &RayTurn,
        light: &LightSample,
        turned: &RgbVec,
        weight: Rgb,
        here: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        if !self.edges_at_rest {
            let ray = RayMotion { turn, chain: &[], parts: &self.parts, shadows: &[], light: None };
            here.u -= ray.send(light.w, turned, weight, sink);
        }
    }

    /// A point or spot light: its strength, its falloff by direction, its position.
    fn intensity<S: AdjointSink>(
        &mut self,
        path: &Stretch<'_>,
        light: &LightSample,
        per_value: Rgb,
        at_light: RgbVec,
        here: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        let item = &self.world.scene.emitters[light.emitter].item.emitter;
        let emission = item.emission(-light.w);
        let per_value = per_value / (path.length * path.length);
        if sink.active().emitters[light.emitter]
            && let Some((footprint, intensity)) = item.footprint(-light.w)
        {
            sink.texels(TextureUse::Emitter(light.emitter), &footprint, per_value * intensity);
        }
        let per_value = per_value.to_array();
        let mut gradients = [EmitterGradient::default(); 3];
        let mut to_flow = [Vec3::ZERO; 3];
        for c in 0..3 {
            let mut adjoint = [0.0; 3];
            adjoint[c] = per_value[c];
            (to_flow[c], gradients[c]) = emission.gradient(adjoint.into());
        }
        let to_flow = RgbVec { r: to_flow[0], g: to_flow[1], b: to_flow[2] };
        // The flow direction runs from the light to the vertex.
        let g = turn(&to_flow, -light.w, path.length);
        here.u += g;
        let at = at_light - g;
        if sink.active().emitters[light.emitter] {
            let at = [at.r, at.g, at.b];
            for c in 0..3 {
                gradients[c].position += at[c];
            }
            sink.emitter(light.emitter, &gradients);
        }
    }
}

/// True when a connection's end at a light may move.
pub(super) fn light_moves(light: &LightSample, active: &ActiveInputs) -> bool {
    match &light.kind {
        LightKind::Area(s) => active.shapes[s.shape as usize],
        LightKind::Position | LightKind::Direction => active.emitters[light.emitter],
        LightKind::Environment => false,
    }
}

/// A directional light: its strength, and its direction through the scattering function and
/// through where the ray crosses interfaces and grids.
fn direction<S: AdjointSink>(
    light: &LightSample,
    to_wi: Option<RgbVec>,
    turn: RgbVec,
    per_value: Rgb,
    sink: &mut S,
) {
    // Both directions and points along the ray turn against the direction of travel.
    let g = -(to_wi.unwrap_or(RgbVec::ZERO) + turn);
    let mut gradients = [EmitterGradient::default(); 3];
    let value = per_value.to_array();
    let direction = [g.r, g.g, g.b];
    for c in 0..3 {
        let mut strength = [0.0; 3];
        strength[c] = value[c];
        gradients[c].strength = strength.into();
        gradients[c].direction = direction[c].reject(light.w);
    }
    sink.emitter(light.emitter, &gradients);
}

/// Sensitivity to the radiance of an area emitter at a point: to its own, to its texels, and to the place of the point on it.
pub(super) fn area<S: AdjointSink>(
    world: &World,
    emitter: usize,
    point: &SurfacePoint,
    adjoint: Rgb,
    slide: &mut RgbVec,
    sink: &mut S,
) {
    let active = sink.active().emitters[emitter];
    let Emitter::TexturedArea { radiance, texture } = &world.scene.emitters[emitter].item.emitter
    else {
        if active && !adjoint.is_zero() {
            strength(emitter, adjoint, sink);
        }
        return;
    };
    let at = world.texture_point(point);
    let by_texture = adjoint * *radiance;
    *slide += texture.gradient(&at) * by_texture;
    if active {
        strength(emitter, adjoint * texture.at_point(&at), sink);
        if let Some(footprint) = texture.footprint(at.uv()) {
            sink.texels(TextureUse::Emitter(emitter), &footprint, by_texture);
        }
    }
}

/// Sensitivity to the radiance that comes from a unit direction of the surroundings.
pub(super) fn surroundings<S: AdjointSink>(
    environment: &Environment,
    w: Vec3,
    adjoint: Rgb,
    sink: &mut S,
) {
    let emitter = environment.emitter;
    if !sink.active().emitters[emitter] || adjoint.is_zero() {
        return;
    }
    let (radiance, map) = environment.parts();
    let Some(map) = map else { return strength(emitter, adjoint, sink) };
    let by_map = adjoint * radiance;
    sink.texels(TextureUse::Emitter(emitter), &map.footprint(w), by_map);
    let (strength, turn) = (adjoint * map.at(w), map.by_rotation(w) * by_map);
    let gradient =
        |strength, rotation| EmitterGradient { strength, rotation, ..EmitterGradient::default() };
    sink.emitter(
        emitter,
        &[
            gradient(Rgb::new(strength.r, 0.0, 0.0), turn.r),
            gradient(Rgb::new(0.0, strength.g, 0.0), turn.g),
            gradient(Rgb::new(0.0, 0.0, strength.b), turn.b),
        ],
    );
}

/// Sensitivity to an emitter's radiance, channel by channel.
fn strength<S: AdjointSink>(emitter: usize, adjoint: Rgb, sink: &mut S) {
    let gradient =
        |r, g, b| EmitterGradient { strength: Rgb::new(r, g, b), ..EmitterGradient::default() };
    sink.emitter(
        emitter,
        &[
            gradient(adjoint.r, 0.0, 0.0),
            gradient(0.0, adjoint.g, 0.0),
            gradient(0.0, 0.0, adjoint.b),
        ],
    );
}
