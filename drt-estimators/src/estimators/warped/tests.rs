//! Derivatives without samples of edges are those with them, and what is wrong with a field is found.

mod ball_lens;
mod chains;
mod levels;
mod rates_across;
mod slab;

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::procedural;
use drt_math::{Affine, Mat3, Rgb, Rng, Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

use crate::derivative::contraction::Motion;
use crate::derivative::tests::choice::{Batches, LIGHT, MOMENT, Sum, derivative, prepare_lit};
use crate::derivative::tests::scenes::*;
use crate::derivative::velocity::{
    Auxiliary, Blend, ChainPart, ChainedRay, Found, Probe, RayTurn, Spatial, TurnPart, TurnParts,
    TurningRay, VelocityField, VertexVelocity, Weight,
};
use crate::model::emitter::Emitter;
use crate::model::filter::{Filter, FilterKind};
use crate::model::scene::Scene;
use crate::model::sensor::{Lens, Sensor};
use crate::model::settings::EstimatorKind;
use crate::model::surface::Bsdf;
use crate::terms::prepared::Prepared;
use crate::world::World;
use crate::world::lights::{EmitterMask, LightSample};
use crate::world::vertex::{Kind, Vertex};

/// The divergence of a constant rate, across a direction that turns, by the constant's component along it.
fn along(rate: Mat3, dir: Vec3) -> f64 {
    rate.trace() - dir.dot(rate * dir)
}

/// What is wrong with a field.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The divergence of the rates is left out.
    Divergence,
    /// Rates have the wrong sign.
    Sign,
    /// Weights do not reach 1 at edges, as by a wrong exponent.
    Weight,
    /// What moves the same everywhere beside a ray has no divergence, as by a frozen direction.
    Direction,
}

#[derive(Debug)]
struct Faulty {
    field: Arc<dyn VelocityField>,
    fault: Fault,
}

impl VelocityField for Faulty {
    fn camera(&self) -> VertexVelocity {
        self.field.camera()
    }

    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        self.field.vertex(world, found, probe, auxiliary)
    }

    fn turn(
        &self,
        world: &World,
        ray: &TurningRay<'_>,
        probe: &mut Probe,
        parts: &mut Vec<TurnPart>,
    ) -> Option<RayTurn> {
        let turn = self.field.turn(world, ray, probe, parts)?;
        for part in &mut parts[turn.parts.clone()] {
            match self.fault {
                Fault::Divergence => part.divergence = Vec3::ZERO,
                Fault::Sign => {
                    part.rate = part.rate * -1.0;
                    part.divergence = -part.divergence;
                }
                Fault::Weight => {
                    part.rate = part.rate * 0.8;
                    part.divergence *= 0.8;
                }
                Fault::Direction => part.divergence += ray.dir * along(part.rate, ray.dir),
            }
        }
        Some(turn)
    }

    fn turn_with_chain(
        &self,
        world: &World,
        chain: &ChainedRay<'_>,
        parts: &mut Vec<TurnPart>,
        chained: &mut Vec<ChainPart>,
    ) -> Option<RayTurn> {
        let mut turn = self.field.turn_with_chain(world, chain, parts, chained)?;
        if let Fault::Divergence = self.fault {
            turn.gradient = Vec3::ZERO;
        }
        for part in &mut chained[turn.chain.clone()] {
            match self.fault {
                Fault::Divergence => part.divergence = Vec3::ZERO,
                Fault::Sign => {
                    part.rate = part.rate * -1.0;
                    part.divergence = -part.divergence;
                }
                Fault::Weight => {
                    part.rate = part.rate * 0.8;
                    part.divergence *= 0.8;
                }
                // A frozen one.
                Fault::Direction => (part.rate, part.divergence) = (Mat3::ZERO, Vec3::ZERO),
            }
        }
        Some(turn)
    }

    fn turn_with_shadows(
        &self,
        world: &World,
        ray: &TurningRay<'_>,
        light: &LightSample,
        light_moves: bool,
        parts: &mut TurnParts,
    ) -> Option<RayTurn> {
        let mut turn = self.field.turn_with_shadows(world, ray, light, light_moves, parts)?;
        let shadow = turn.shadow.as_mut().expect("a shadow");
        let mut shares: Vec<_> = parts.shadows.iter_mut().map(|part| &mut part.share).collect();
        shares.push(&mut shadow.by_light);
        for share in shares {
            match self.fault {
                Fault::Divergence => share.gradient = Vec3::ZERO,
                Fault::Sign => *share = *share * Weight::constant(-1.0),
                Fault::Weight => *share = *share * Weight::constant(0.8),
                Fault::Direction => shadow.at.inv_range = 0.0,
            }
        }
        Some(turn)
    }

    fn blend(&self, world: &World, viewer: &Vertex, end: &Vertex, dir: Vec3, d: f64) -> Blend {
        self.field.blend(world, viewer, end, dir, d)
    }
}

/// The scene of a builder, to a depth of two, as a camera at a point sees it that looks at another one through a filter.
fn seen_through(filter: FilterKind, scene: SceneBuilder, place: [Vec3; 2]) -> Scene {
    let mut scene = seen(scene, place, 2);
    let filter = Filter::new(filter).expect("a valid filter");
    let [origin, target] = place;
    let sensor = Sensor::look_at([origin, target, Vec3::Y], Lens::with_fov(40.0), FILM, filter);
    scene.sensors[0].item.sensor = sensor.expect("a valid camera");
    scene
}

fn compare(scene: &Scene, motion: &Parameter, sum: Sum, faults: &[Fault]) {
    compare_lit(EmitterMask::Extended, scene, motion, sum, faults);
}

fn compare_lit(lit: EmitterMask, scene: &Scene, motion: &Parameter, sum: Sum, faults: &[Fault]) {
    let (other, depth) = match lit {
        EmitterMask::Delta => (EstimatorKind::PathSpace, 2),
        _ => (EstimatorKind::Radiative, 4),
    };
    let by = |kind| prepare_lit(kind, lit, scene, motion, depth);
    assert_found(&derivative(sum, &by(other)), sum, || by(EstimatorKind::Warped), faults);
}

/// Standard errors at which a fault has shown.
const CLEAR: f64 = 8.0;

/// Asserts that a derivative is what another one is, and that it is not with faults.
fn assert_found(
    reference: &Batches,
    sum: Sum,
    warped: impl Fn() -> (Prepared, Motion),
    faults: &[Fault],
) {
    let off = |sum, prepared: &(Prepared, Motion)| derivative(sum, prepared).off(reference);
    let fair = off(sum, &warped());
    assert!(fair.0.abs() < 4.0 && fair.1 < 0.1, "{fair:?} of {}", reference.mean());
    for fault in faults {
        let (mut prepared, motion) = warped();
        let field = Arc::clone(&prepared.terms.velocity);
        prepared.terms.velocity = Arc::new(Faulty { field, fault: *fault });
        let faulty = (prepared, motion);
        // Most faults show in a quarter of the batches.
        let mut found = off(Sum { batches: sum.batches / 4, ..sum }, &faulty);
        if found.0.abs() < CLEAR {
            found = off(sum, &faulty);
        }
        assert!(found.0.abs() > 5.0, "{fault:?} {found:?}");
    }
}

#[test]
fn on_surfaces() {
    let scene = surfaces(diffuse(0.3, 0.5, 0.4), diffuse(0.6, 0.5, 0.7));
    let motion = parameter("ball", 0.0, alloc::vec![moves("ball", shift())]);
    let faults = [Fault::Divergence, Fault::Sign, Fault::Weight];
    compare(&scene, &motion, Sum { samples: 256, ..MOMENT }, &faults);
}

/// The shadows that a card, out of view, casts on a floor, by a bulb and the sun.
fn shadows() -> Scene {
    let grey = || diffuse(0.6, 0.5, 0.4);
    let up = Mat3::rotation(Vec3::X, -core::f64::consts::FRAC_PI_2) * 4.0;
    let at = |shift: f64| Affine { linear: up, translation: vec3(0.0, shift, 0.0) };
    let floor = procedural::grid(2, 2).transform(&at(-1.0));
    let card = placed(procedural::cube(), vec3(0.3, 0.2, 0.3), 0.5, vec3(0.1, 0.9, 0.2));
    let position = vec3(-0.3, 2.3, 0.4);
    let bulb = Emitter::Point { position, intensity: Rgb::new(3.0, 4.0, 2.0) };
    let direction = vec3(0.3, -1.0, -0.3);
    let sun = Emitter::Directional { direction, irradiance: Rgb::new(0.7, 0.6, 0.5) };
    let scene = SceneBuilder::new()
        .shape("floor", ShapeBuilder::new(floor, grey()))
        .shape("card", ShapeBuilder::new(card, grey()))
        .emitter("bulb", bulb)
        .emitter("sun", sun);
    seen(scene, [vec3(0.3, 0.3, 3.5), vec3(0.0, -1.0, 0.0)], 4)
}

#[test]
fn in_shadows_of_points_and_directions() {
    let turn = GeometryChange::Rotate { axis: vec3(0.3, 0.1, 0.9), pivot: Vec3::ZERO };
    let up = GeometryChange::Translate(Vec3::Y);
    let tip = GeometryChange::Rotate { axis: vec3(0.9, 0.2, 0.5), pivot: -Vec3::Y };
    let all = [Fault::Divergence, Fault::Sign, Fault::Weight];
    for (name, change, sum, faults) in [
        ("card", shift(), MOMENT, &all[..]),
        ("bulb", shift(), MOMENT, &all[..]),
        ("card", up, LIGHT, &[Fault::Direction]),
        ("sun", turn, LIGHT, &[Fault::Divergence]),
        // What its own rate changes by along the floor has a part in the divergence.
        ("floor", tip, MOMENT, &[Fault::Divergence]),
    ] {
        let motion = parameter(name, 0.0, alloc::vec![moves(name, change)]);
        compare_lit(EmitterMask::Delta, &shadows(), &motion, sum, faults);
    }
}

/// What approaches changes most by the divergence of what is the same everywhere.
#[test]
fn seen_by_a_camera_that_approaches() {
    let scene = surfaces(diffuse(0.3, 0.5, 0.4), diffuse(0.6, 0.5, 0.7));
    let forward = GeometryChange::Translate(vec3(0.0, 0.0, -1.0));
    let motion = parameter("camera", 0.0, alloc::vec![moves("camera", forward)]);
    compare(&scene, &motion, LIGHT, &[Fault::Direction]);
}

#[test]
fn in_media() {
    let motion = parameter("card", 0.0, alloc::vec![moves("card", shift())]);
    let faults = [Fault::Divergence, Fault::Sign, Fault::Weight];
    compare(&glow(), &motion, LIGHT, &faults);
}

/// A ball of many facets that glows, over a floor, and half hidden from that by a card. Another lamp lights all of them.
fn glowing_ball(ball_bsdf: Bsdf) -> Scene {
    let glow = Emitter::Area { radiance: Rgb::new(4.0, 3.0, 5.0) };
    let ball = ShapeBuilder::new(ball(0.35, vec3(0.1, 0.7, 0.0)), ball_bsdf).emitter(glow);
    let grey = || diffuse(0.6, 0.5, 0.4);
    let card = placed(procedural::cube(), vec3(0.3, 0.02, 0.3), 0.5, vec3(0.4, 0.0, 0.1));
    let scene = SceneBuilder::new()
        .shape("ball", ball)
        .shape("card", ShapeBuilder::new(card, grey()))
        .shape("floor", ShapeBuilder::new(floor(), grey()))
        .shape("lamp", glowing(lamp(), Rgb::new(9.0, 9.0, 9.0)));
    seen(scene, [vec3(0.3, 0.9, 4.0), vec3(0.0, -0.1, 0.0)], 4)
}

/// What a lamp emits jumps at none of its creases, and what it scatters jumps at all of them.
#[test]
fn lamps_of_facets() {
    let motion = parameter("ball", 0.0, alloc::vec![moves("ball", shift())]);
    let sum = Sum { samples: 512, ..MOMENT };
    for bsdf in [diffuse(0.0, 0.0, 0.0), diffuse(0.8, 0.9, 0.7)] {
        compare(&glowing_ball(bsdf), &motion, sum, &[Fault::Sign, Fault::Weight]);
    }
}

/// Beside the outline of a lamp of few facets, some of which are seen nearly edge-on, rates change gradually: a ray does not follow the card
/// before the lamp right up to the outline.
#[test]
fn rates_rise_gradually_from_outlines() {
    let motion = parameter("card", 0.0, alloc::vec![moves("card", shift())]);
    let lit = EmitterMask::Extended;
    let black = || diffuse(0.0, 0.0, 0.0);
    let glow = Emitter::Area { radiance: Rgb::new(4.0, 3.0, 5.0) };
    let ball = ball(0.35, vec3(0.1, 0.7, 0.0));
    let card = placed(procedural::cube(), vec3(0.3, 0.1, 0.02), 0.5, vec3(0.3, 0.7, 0.6));
    let scene = SceneBuilder::new()
        .shape("ball", ShapeBuilder::new(ball, black()).emitter(glow))
        .shape("card", ShapeBuilder::new(card, black()));
    let scene = seen(scene, [vec3(0.3, 0.9, 4.0), vec3(0.1, 0.7, 0.0)], 4);
    let (prepared, _) = prepare_lit(EstimatorKind::Warped, lit, &scene, &motion, 4);
    let c = vec3(0.6, 0.3, 0.1);
    let (mut last, mut steps) = (None, 0);
    for row in 0..50 {
        for k in 0..6000 {
            let point = [f64::from(k) * 1e-3, f64::from(row) * 0.1];
            let (pixel, dir) = rates_across::seen_at(&prepared, point);
            let end = rates_across::asked(&prepared, pixel, dir, |_, ray| Some(ray.end?.shape));
            let rate = rates_across::rate(&prepared, pixel, dir, c).unwrap_or_default().0;
            if let Some((shape, before)) = last
                && end == Some(0)
                && shape == end
            {
                steps += u32::from(before != Vec3::ZERO);
                let step = (rate - before).length();
                assert!(step < 0.01, "{step} at {point:?}: {before:?} {rate:?}");
            }
            last = Some((end, rate));
        }
    }
    assert!(steps > 1000, "{steps}");
}

/// The rate of rays from many places to a lamp does not jump at its creases, whether its light does or not: what is scattered on the way
/// there sees the rate.
#[test]
fn rates_do_not_jump_at_creases() {
    let motion = parameter("camera", 0.0, alloc::vec![moves("camera", shift())]);
    let mut seen = 0;
    for (bsdf, emission_alone) in [
        (diffuse(0.8, 0.9, 0.7), false),
        (diffuse(0.8, 0.9, 0.7), true),
        (diffuse(0.0, 0.0, 0.0), false),
        (diffuse(0.0, 0.0, 0.0), true),
    ] {
        let lit = EmitterMask::Extended;
        let scene = glowing_ball(bsdf);
        let (prepared, _) = prepare_lit(EstimatorKind::Warped, lit, &scene, &motion, 4);
        let (world, field) = (&prepared.world, &prepared.terms.velocity);
        let triangles = &world.scene.shapes[0].mesh.triangles;
        let mut probe = Probe::new(Rng::new(0, 0, 0));
        let mut weight = |triangle: u32, edge: [u32; 2], eye: Vec3| {
            let corners = triangles[triangle as usize];
            let half = |v: u32| if edge.contains(&v) { 0.5 } else { 0.0 };
            let (end, x) = world.point(triangle, [half(corners[1]), half(corners[2])]);
            let (viewer, ray) =
                (Vertex { x: eye, medium: None, kind: Kind::Volume(None) }, x - eye);
            if end.ng.dot(ray) > -0.01 {
                return None;
            }
            let ray = TurningRay {
                viewer: &viewer,
                moves: true,
                of_camera: None,
                dir: ray.normalize(),
                distance: ray.length(),
                end: Some(&end),
                emission_alone,
                tangent_plane: None,
            };
            let turn = field.turn(world, &ray, &mut probe, &mut Vec::new());
            Some(turn.map_or(0.0, |turn| turn.weight))
        };
        for eye in [vec3(0.3, 0.9, 4.0), vec3(1.5, 0.2, 0.6), vec3(-0.4, 1.6, -0.9)] {
            for (a, one) in (0..).zip(triangles) {
                for (b, other) in (0..a).zip(triangles) {
                    let shared = one.map(|v| other.contains(&v));
                    let [Some(i), Some(k)] = [true, false].map(|first| {
                        let mut found = (0..3).filter(|c| shared[*c]);
                        if first { found.next() } else { found.nth(1) }
                    }) else {
                        continue;
                    };
                    let edge = [one[i], one[k]];
                    let [Some(here), Some(there)] = [a, b].map(|t| weight(t, edge, eye)) else {
                        continue;
                    };
                    seen += 1;
                    assert!((here - there).abs() < 1e-6, "{here} {there}, {emission_alone}");
                }
            }
        }
    }
    assert!(seen > 500, "{seen}");
}

/// Curved matter near a viewer has a part in a vertex's velocity that falls with the square of the distance, or its difference
/// from the viewer's velocity would turn short segments without bounds.
#[test]
fn matter_near_a_viewer_does_not_turn_segments() {
    let scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
    let motion = parameter("ball", 0.0, alloc::vec![moves("ball", shift())]);
    let lit = EmitterMask::Extended;
    let (prepared, of) = prepare_lit(EstimatorKind::Warped, lit, &scene, &motion, 4);
    let (world, field) = (&prepared.world, &prepared.terms.velocity);
    let curvature = Spatial::new(world, &of.active).blends.curvature(0);
    // On one of the ball's triangles, from its outside.
    let at = |bary: [f64; 2]| {
        let (point, x) = world.point(7, bary);
        Vertex { x, medium: None, kind: Kind::Surface(point) }
    };
    let end = at([0.3; 2]);
    assert!(curvature > 0.0 && end.surface().is_some_and(|s| s.shape == 0), "{curvature}");
    let of = |viewer: &Vertex, end: &Vertex| {
        let ray = end.x - viewer.x;
        field.blend(world, viewer, end, ray.normalize(), ray.length())
    };
    for distance in [1e-6, 1e-3, 0.1, 0.5, 3.0] {
        let x = end.x + vec3(0.3, 0.9, 0.2).normalize() * distance;
        let viewer = Vertex { x, medium: None, kind: Kind::Volume(None) };
        let Blend { weight, gradient } = of(&viewer, &end);
        let far = distance * curvature;
        assert!((0.0..=1.0).contains(&weight) && weight <= 20.0 * far * far, "{distance} {weight}");
        assert!(far < 2.0 || weight > 0.95, "{distance} {weight}");
        let step = 1e-4 * f64::min(distance, 1.0);
        let [a, b] = [step, -step].map(|s| at([0.3 + s, 0.3]));
        let (difference, expected) =
            (of(&viewer, &a).weight - of(&viewer, &b).weight, gradient.dot(a.x - b.x));
        let size = gradient.length() * (a.x - b.x).length();
        assert!((difference - expected).abs() <= 1e-3 * size, "{distance} {difference} {expected}");
    }
}
