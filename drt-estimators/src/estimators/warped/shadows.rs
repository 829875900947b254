//! Rays that turn with the [shadows](crate::derivative::velocity::ShadowTurn) of points and directions.
//!
//! Where a pixel has borders, a ray beside no shadow has the rate T_e that follows edges [across alone](super::rates_across). Beside shadows it has
//!
//! ```text
//! T = s T_w + (1 - s) T_e,    s = W / (1 + W),
//! ```
//!
//! T_w being the mean of all rates by the weights of edges, shadows and borders, and W the weight of shadows. Both rates are right at edges and
//! at borders, and s rises to 1 at shadows and falls to 0 where their weight ends, so that T is right at all of them and continuous.
//!
//! A shadow that lies exactly along the border of a pixel, as in symmetric scenes, leaves one pixel for the other at the full rate: the weight of borders is divided
//! by one more than that of such shadows, and diverges where these end.

use alloc::boxed::Box;

use drt_math::{Vec3, fm};

use crate::derivative::velocity::{
    RayTurn, ShadowPart, ShadowPlace, ShadowTurn, TurnParts, TurningRay, Weight,
};
use crate::estimators::warped::angular_distance::Beside;
use crate::estimators::warped::edge_weights::{ANGLE, Near};
use crate::estimators::warped::edges::{Limits, TurningEdges, divide};
use crate::model::sensor::Sensor;
use crate::world::World;
use crate::world::lights::{LightKind, LightSample};
use crate::world::vertex::SurfacePoint;

/// The flow of a light to a point on a surface.
pub(super) struct Flow<'a> {
    place: ShadowPlace,
    /// The camera, of a ray that starts there, if its filter has borders.
    camera: Option<&'a Sensor>,
    near: Near,
    /// How far the point moves across the flow to each radian of the light's view, in scene units.
    range: f64,
    at_infinity: bool,
}

impl<'a> Flow<'a> {
    /// To where a ray ends, at the surface point `s`. Shadows count within a distance of what the ray sees within an `angle`
    /// there, and within [`ANGLE`] as seen by the light, which at infinity is taken as seen from the distance of the scene's radius. `None`
    /// for emitters with an area.
    pub(super) fn new(
        world: &'a World,
        ray: &TurningRay<'_>,
        s: &SurfacePoint,
        light: &LightSample,
        angle: f64,
    ) -> Option<Self> {
        let at_infinity = match light.kind {
            LightKind::Area(_) | LightKind::Environment => return None,
            LightKind::Position => false,
            LightKind::Direction => true,
        };
        let flow = -light.w;
        let side = if s.ng.dot(flow) < 0.0 { -1.0 } else { 1.0 };
        let normal = s.ng * side;
        let range = if at_infinity { world.geometry.radius } else { light.distance };
        let inv_range = if at_infinity { 0.0 } else { 1.0 / range };
        let TurningRay { dir, distance, .. } = *ray;
        let x = ray.viewer.x + dir * distance;
        // Squared sines, added as resistances are.
        let of_light = 1.0 / (fm::sin(ANGLE) * fm::sin(ANGLE));
        let seen =
            Weight { value: distance, gradient: dir * range } * Weight::constant(fm::sin(angle));
        let far =
            Weight { value: range, gradient: if at_infinity { Vec3::ZERO } else { flow * range } };
        let square =
            Weight::constant(1.0) / (Weight::constant(of_light) + far * far / (seen * seen));
        let near = Near::of_flow(x, flow, range, at_infinity, normal, square);
        let place =
            ShadowPlace { matter: s.material(), normal, side, dir, distance, flow, inv_range };
        let sees_borders = ray.of_camera.is_some() && world.camera.has_borders();
        let camera = sees_borders.then_some(&world.camera);
        Some(Self { place, camera, near, range, at_infinity })
    }

    /// Whether the shadow of the straight line between two points on the plane of the surface is seen along a border between pixels.
    fn falls_on_border(&self, ends: [Vec3; 2]) -> bool {
        let ShadowPlace { normal, flow, dir, distance, .. } = self.place;
        self.camera.is_some_and(|camera| {
            let x = camera.position() + dir * distance;
            let from = x - flow * self.range;
            camera.sees_on_border(ends.map(|end| {
                let along = if self.at_infinity { flow } else { end - from };
                end + along * (normal.dot(x - end) / normal.dot(along))
            }))
        })
    }

    /// How far the shadow of a point beside the flow goes with the point, and how far with the light, with gradients by the place
    /// where it falls. `side` is what the point moves by as it goes along its edge.
    fn cast(&self, beside: &Beside, side: Vec3) -> [Weight; 2] {
        let Self { place: ShadowPlace { flow, .. }, range, .. } = *self;
        let one = Weight::constant(1.0);
        let by_place = |w: Weight| w.map_gradient(|g| g / range);
        if self.at_infinity {
            let gradient = flow - by_place(beside.along).gradient * side.dot(flow);
            [one, Weight { value: -beside.place.dot(flow), gradient }]
        } else {
            let k = Weight { value: range, gradient: flow } / by_place(beside.distance);
            [k, one - k]
        }
    }
}

impl TurningEdges {
    /// As [`turn`](Self::turn) does, and with the shadows that edges cast where the ray ends. `None` without any, and where neither
    /// edges nor the ray nor, by `moves`, the light or the surface moves.
    pub(super) fn turn_with_shadows(
        &self,
        ray: &TurningRay<'_>,
        flow: &Flow<'_>,
        limits: &Limits,
        moves: bool,
        parts: &mut TurnParts,
    ) -> Option<RayTurn> {
        let Limits { angle, rest, borders } = *limits;
        let TurnParts { edges, shadows } = parts;
        let [first, first_shadow] = [edges.len(), shadows.len()];
        let mut any = moves || ray.moves;
        let [mut weight, mut by_light, mut on_border] = [Weight::default(); 3];
        let place = &flow.place;
        let by_direction = |w: Weight| w.map_gradient(|g| place.by_direction(g));
        self.visit(&flow.near, |edge, beside, of_edge| {
            let by_place = |w: Weight| w.map_gradient(|g| g / flow.range);
            let [a, b] = edge.ends;
            let [with_edge, with_light] = flow.cast(beside, b - a);
            let own = by_place(of_edge);
            weight += by_direction(own);
            if flow.falls_on_border(edge.ends) {
                on_border += by_direction(own);
            }
            by_light += by_direction(own * with_light);
            if edge.moves {
                any = true;
                let along = by_place(beside.along);
                let parts = [Weight::constant(1.0) - along, along];
                for (end, part) in parts.into_iter().enumerate() {
                    let share = by_direction(own * with_edge * part);
                    shadows.extend(edge.matter(end).map(|matter| ShadowPart { matter, share }));
                }
            }
        });
        if !(any && weight.value > 0.0) {
            return None;
        }
        let near = self.near(ray, angle);
        let turned = self.gather(&near, ray.moves, edges);
        let rest = rest / (Weight::constant(1.0) + on_border);
        let total = Weight::constant(1.0) + turned + rest + weight;
        divide(&mut edges[first..], ray.dir, total);
        let mut scale = Weight::constant(1.0) / total;
        let mut sum = (turned + weight) / total;
        if let Some(borders) = borders {
            let one = Weight::constant(1.0);
            let part = weight / (one + weight);
            edges[first..].iter_mut().for_each(|edge| *edge = edge.scaled(part));
            let across = edges.len();
            let held = self.gather_held(&near, ray, &borders, edges);
            edges[across..].iter_mut().for_each(|edge| *edge = edge.scaled(one - part));
            scale = scale * part;
            sum = sum * part + held / (one + held) * (one - part);
        }
        for part in &mut shadows[first_shadow..] {
            part.share = part.share * scale;
        }
        let shadow = ShadowTurn { at: *place, weight: weight * scale, by_light: by_light * scale };
        let Weight { value: weight, gradient } = sum;
        Some(RayTurn {
            weight,
            gradient,
            parts: first..edges.len(),
            chain: 0..0,
            shadow: Some(Box::new(shadow)),
        })
    }
}
