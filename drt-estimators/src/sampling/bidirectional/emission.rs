//! Where paths of light start.

use alloc::vec::Vec;
use core::f64::consts::{FRAC_1_PI, PI};

use drt_geom::Aabb;
use drt_math::{Frame, Rgb, Rng, Vec3, warp};

use crate::model::emitter::Emitter;
use crate::world::lights::{LightKind, LightSample, LightTable};
use crate::world::vertex::{Kind, SurfacePoint, Vertex};
use crate::world::{SurroundingMedium, World};

/// A ray that leaves an emitter.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmittedRay {
    pub(super) vertex: Vertex,
    /// Unit.
    pub(super) dir: Vec3,
    pub(super) emitter: usize,
    /// 1 over the density of the ray, times the cosine at an area.
    pub(super) inv_pdf: f64,
    /// What it carries over its density.
    pub(super) throughput: Rgb,
    /// Density of the direction, and of a directional emitter that of the point, per unit of area across the flow.
    pub(super) pdf: f64,
    /// Cosine at the emitter over the density of the point per area and of the direction; 0 of points and directions.
    pub(super) inv_start: f64,
    /// It comes from a point in the scene.
    pub(super) finite: bool,
}

/// What starting from emitters needs to know of a scene.
#[derive(Clone, Debug)]
pub(crate) struct EmissionSampler {
    /// Media around shapes.
    around: Vec<SurroundingMedium>,
    /// Media around the emitters that are points.
    at_points: Vec<SurroundingMedium>,
    /// Of the sphere from which light of directions comes.
    center: Vec3,
    radius: f64,
    /// Medium outside.
    outside: Option<usize>,
}

impl EmittedRay {
    /// Where it starts, as a point or direction from which light reaches x, and what multiplies its
    /// [value](LightSample::value) there.
    pub(super) fn seen_from(&self, world: &World, x: Vec3) -> Option<(LightSample, f64)> {
        let Kind::Surface(point) = self.vertex.kind else {
            let light = LightTable::delta(world, self.emitter, x, 1.0)?;
            let spread = if self.finite { light.distance * light.distance } else { 1.0 };
            return Some((light, self.inv_pdf * spread));
        };
        let d = self.vertex.x - x;
        let distance = d.length();
        let pdf = world.lights.area_pdf(&point, d / distance, distance);
        let light = LightSample {
            emitter: self.emitter,
            kind: LightKind::Area(point),
            w: d / distance,
            y: self.vertex.x,
            distance,
            value: world.area_radiance(self.emitter, &point),
            inv_pdf: 1.0 / pdf,
            pdf,
        };
        Some((light, self.inv_pdf))
    }
}

impl EmissionSampler {
    pub(crate) fn new(world: &World) -> Self {
        let scene = &world.scene;
        let at_point = |emitter: &Emitter| match emitter.position() {
            Some(x) => world.medium_near(&Aabb::around([x])),
            None => SurroundingMedium::Uniform(None),
        };
        Self {
            around: (0..scene.shapes.len()).map(|s| world.medium_around(s)).collect(),
            at_points: scene.emitters.iter().map(|e| at_point(&e.item.emitter)).collect(),
            center: world.geometry.center,
            radius: f64::max(world.geometry.radius, f64::MIN_POSITIVE) * 1.001,
            outside: world.ambient(),
        }
    }

    /// Draws an emitter, a point and a direction.
    pub(super) fn sample(&self, world: &World, rng: &mut Rng) -> Option<EmittedRay> {
        let choice = world.lights.choose(rng)?;
        if let Some(emitter) = choice.delta {
            return self.sample_delta(world, emitter, choice.pmf, rng);
        }
        let (s, x) = world.lights.point_of(world, &choice, rng)?;
        let local = warp::cosine_hemisphere(rng.next_2d());
        let dir = Frame::from_normal(s.ng).to_world(local);
        let cosine = s.ng.dot(dir);
        let per_area = world.lights.area_density(&s);
        if cosine <= 0.0 || per_area <= 0.0 {
            return None;
        }
        let medium = self.around[s.shape as usize].toward(world, x, dir);
        Some(EmittedRay {
            vertex: Vertex { x, medium, kind: Kind::Surface(s) },
            dir,
            emitter: world.scene.shapes[s.shape as usize].emitter?,
            inv_pdf: PI / per_area,
            throughput: world.emitted(&s, dir) * (PI / per_area),
            pdf: cosine * FRAC_1_PI,
            inv_start: PI / per_area,
            finite: true,
        })
    }

    fn sample_delta(
        &self,
        world: &World,
        emitter: usize,
        pmf: f64,
        rng: &mut Rng,
    ) -> Option<EmittedRay> {
        let light = &world.scene.emitters[emitter].item.emitter;
        let u = rng.next_2d();
        let (x, dir, pdf, medium) = match *light {
            Emitter::Directional { direction, .. } => {
                let dir = direction.normalize();
                let frame = Frame::from_normal(dir);
                let [a, b] = warp::concentric_disk(u).map(|c| c * self.radius);
                let x = self.center - dir * self.radius + frame.s * a + frame.t * b;
                (x, dir, self.per_area(), self.outside)
            }
            _ => {
                let flow = light.sample_flow(u)?;
                let x = light.position()?;
                (x, flow.flow, flow.pdf, self.at_points[emitter].toward(world, x, flow.flow))
            }
        };
        Some(EmittedRay {
            vertex: Vertex { x, medium, kind: Kind::Point },
            dir,
            emitter,
            inv_pdf: 1.0 / (pmf * pdf),
            throughput: light.emission(dir).value / (pmf * pdf),
            pdf,
            inv_start: 0.0,
            finite: light.position().is_some(),
        })
    }

    /// Density of points from which light of a direction comes.
    fn per_area(&self) -> f64 {
        1.0 / (PI * self.radius * self.radius)
    }

    /// Density of the flow of a light to a vertex, given the emitter's point: per solid angle over the squared distance; times the cosine at
    /// the vertex it is per area.
    pub(super) fn flow_pdf(&self, world: &World, light: &LightSample) -> f64 {
        let square = light.distance * light.distance;
        match &light.kind {
            LightKind::Area(s) => area_flow_pdf(s, -light.w) / square,
            LightKind::Position => {
                let emitter = &world.scene.emitters[light.emitter].item.emitter;
                emitter.flow_pdf(-light.w) / square
            }
            LightKind::Direction => self.per_area(),
            // No path starts there.
            LightKind::Environment => 0.0,
        }
    }
}

/// Density of directions that leave an area emitter.
pub(super) fn area_flow_pdf(s: &SurfacePoint, dir: Vec3) -> f64 {
    f64::max(s.ng.dot(dir), 0.0) * FRAC_1_PI
}
