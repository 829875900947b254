//! Images by paths from both ends (Veach 1997, chapter 10; Lafortune and Willems 1993).
//!
//! A path z_0 … z_{t-1} from the camera and one y_0 … y_{s-1} from an emitter are joined in every way: by each prefix of one with
//! each of the other. A light path of n segments is found by n + 1 of these strategies (s, t), whose contributions
//! are weighted by the power heuristic with exponent 2,
//!
//! | s, t | what joins them |
//! |---|---|
//! | 0, t | the camera's path meets an emitter, emission in a medium, or leaves the scene |
//! | 1, t | next-event estimation: a point chosen for the vertex |
//! | s, 1 | the light's vertex is connected to the camera, and splatted |
//! | s, t | the vertices are connected |
//!
//! # Weights
//!
//! In measures of area and volume the density of a strategy is a product over its vertices of the density of the
//! direction that led there, the cosine there (1 in a volume) over the squared distance, the transmittance τ of the segment,
//! and in a volume σ_t. Every inner vertex is drawn by one side or the other, so σ_t is in all strategies' densities and
//! cancels; transmittance is in all but that whose connection the segment is. Ratios of densities need τ of single
//! segments alone. In grids it has no closed form: there, and for colours, a [proxy](proxy_attenuation) takes its place, in
//! all strategies alike, so that weights add up to 1 for any medium, and are best where it is exact.
//!
//! Sums over strategies are light from vertex to vertex (Georgiev 2012; van Antwerpen 2011): with p the density of the direction that
//! left a vertex, p' that of the one back, and c the cosine at the vertex that is arrived at,
//!
//! ```text
//! at the start      d = p_connect / p_start,                  e = c_0 / p_start (0 of what has no area)
//! scattering        e ← (c/p) (e p' + d),                     d ← 1/p
//! smooth surfaces   e ← c e,                                  d ← 0
//! arriving          d ← d r² / (c τ),                         e ← e / c
//! ```
//!
//! with all numbers but the densities of one strategy squared. d p stands for connecting the last segment instead of drawing it, e for connecting an earlier one.
//! Then the weight of a strategy is 1 / (1 + a_y + a_z) with
//!
//! ```text
//! connection        a_y = τ² p_z(→y)² (c_y/r²)² (d_y + e_y p'_y²), and a_z likewise
//! next event        a_y = τ² (p_z / p_light)²,       a_z = τ² (p_flow c/r²)² (d_z + e_z p'_z²)
//! camera            a_y = τ² (p_film c/r²)² (d_y + e_y p'_y²) / n²
//! emission met      a_z = p_light² d_z + p_start² e_z
//! ```
//!
//! n being the number of light paths to one sample of each pixel, as many as pixels. Russian roulette is left out of all of it.

mod emission;
mod subpath;
#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use drt_math::{Real, Rgb, Vec3};

use crate::model::surface::Given;
pub(crate) use crate::sampling::bidirectional::emission::EmissionSampler;
use crate::sampling::bidirectional::emission::area_flow_pdf;
use crate::sampling::bidirectional::subpath::{
    Ratios, Subpath, SubpathVertex, Unconnected, square,
};
use crate::sampling::film::Splat;
use crate::sampling::flight::proxy_attenuation;
use crate::sampling::mode::{ImportanceMode, RadianceMode, TransportMode};
use crate::sampling::trace::{OutgoingRay, Tracer};
use crate::world::World;
use crate::world::lights::LightKind;
use crate::world::vertex::Vertex;

/// Joins paths from both ends.
pub(crate) struct Bidirectional<'w> {
    world: &'w World,
    emission: &'w EmissionSampler,
    /// Light paths to one sample of each pixel.
    light_paths: f64,
    camera: Subpath,
    light: Subpath,
    #[cfg(all(test, feature = "std"))]
    fault: Option<tests::Fault>,
}

impl<'w> Bidirectional<'w> {
    pub(crate) fn new(world: &'w World, emission: &'w EmissionSampler) -> Self {
        let [width, height] = world.camera.film();
        Self {
            world,
            emission,
            light_paths: f64::from(width) * f64::from(height),
            camera: Subpath::new(RadianceMode::GIVEN),
            light: Subpath::new(ImportanceMode::GIVEN),
            #[cfg(all(test, feature = "std"))]
            fault: None,
        }
    }

    /// Traces a path from either end. Returns what comes along the camera's ray, times its `weight`; what reaches the film elsewhere is
    /// added to `splats`.
    pub(crate) fn trace(
        &mut self,
        tracer: &mut Tracer<'w>,
        dir: Vec3,
        weight: Rgb,
        splats: &mut Vec<Splat>,
    ) -> Rgb {
        self.trace_camera(tracer, dir, weight);
        let mut sum = self.camera.met;
        self.trace_light(tracer);
        for k in 0..self.camera.vertices.len() {
            let z = self.camera.vertices[k];
            sum += self.met(&z, k == 0);
            if z.segments >= tracer.max_segments {
                continue;
            }
            sum += self.next_event(tracer, &z);
            for y in 0..self.light.vertices.len() {
                let y = self.light.vertices[y];
                if z.segments + y.segments < tracer.max_segments {
                    sum += self.connection(tracer, &z, &y);
                }
            }
        }
        for y in 0..self.light.vertices.len() {
            let y = self.light.vertices[y];
            splats.extend(self.seen(tracer, &y));
        }
        sum
    }

    fn trace_camera(&mut self, tracer: &mut Tracer<'w>, dir: Vec3, weight: Rgb) {
        let leaving = tracer.camera_ray(dir, weight);
        let world = self.world;
        let film = world.camera.view(world.camera.position() + dir).importance;
        let ratios = Ratios { last: square(self.light_paths / film), earlier: 0.0 };
        self.camera.begin(ratios, true);
        type Mode = Unconnected<RadianceMode>;
        if let Some(first) = tracer.follow::<Mode, _>(&leaving, &mut self.camera) {
            tracer.walk::<Mode, _>(first, &mut self.camera);
        }
    }

    fn trace_light(&mut self, tracer: &mut Tracer<'w>) {
        self.light.begin(Ratios::default(), true);
        // Walks of importance end a segment earlier than what they are connected to.
        if tracer.max_segments < 2 {
            return;
        }
        let Some(start) = self.emission.sample(self.world, &mut tracer.rng) else { return };
        let ratios = Ratios { last: 1.0 / square(start.pdf), earlier: square(start.inv_start) };
        self.light.begin(ratios, start.finite);
        let leaving = OutgoingRay::starting(start.vertex, start.dir, start.throughput);
        type Mode = Unconnected<ImportanceMode>;
        if let Some(first) = tracer.follow::<Mode, _>(&leaving, &mut self.light) {
            tracer.walk::<Mode, _>(first, &mut self.light);
        }
    }

    /// The emission of a surface that the camera's path meets, at once or later.
    fn met(&self, z: &SubpathVertex, at_once: bool) -> Rgb {
        let Some(s) = z.vertex.surface().filter(|s| self.world.emits(s)) else { return Rgb::ZERO };
        let value = z.throughput * self.world.emitted(s, z.from);
        if value.is_zero() || at_once {
            return value;
        }
        let per_area = self.world.lights.area_density(s);
        let start = per_area * area_flow_pdf(s, z.from);
        let others = square(per_area) * z.ratios.last + square(start) * z.ratios.earlier;
        value * (1.0 / (1.0 + others))
    }

    /// Next-event estimation.
    fn next_event(&self, tracer: &mut Tracer<'w>, z: &SubpathVertex) -> Rgb {
        let world = self.world;
        let Some(scattering) = world.scattering(&z.vertex) else { return Rgb::ZERO };
        let light = world.lights.sample(world, z.vertex.x, &mut tracer.rng);
        let Some(light) = light else { return Rgb::ZERO };
        let f = RadianceMode::value(&scattering, z.from, light.w);
        if f.is_zero() {
            return Rgb::ZERO;
        }
        let target = light.point().map(|s| s.prim);
        let Some((passed, attenuation)) = tracer.passed(&z.vertex, light.w, light.distance, target)
        else {
            return Rgb::ZERO;
        };
        let hit = match light.kind {
            LightKind::Area(_) => scattering.pdf(z.from, light.w, Given::Wo) * light.inv_pdf,
            _ => 0.0,
        };
        let back = self.camera.back(&scattering, light.w, z.from);
        let flow = self.emission.flow_pdf(world, &light) * z.cosine(light.w);
        let others = square(hit) + square(flow) * z.ratios.all(back);
        let weight = 1.0 / (1.0 + square(attenuation) * others);
        z.weight() * f * passed * light.value * (light.inv_pdf * weight)
    }

    /// Of a vertex of the camera's path with one of the light's.
    fn connection(&self, tracer: &mut Tracer<'w>, z: &SubpathVertex, y: &SubpathVertex) -> Rgb {
        #[cfg(all(test, feature = "std"))]
        if self.fault == Some(tests::Fault::NoConnections) {
            return Rgb::ZERO;
        }
        let world = self.world;
        let (of_z, of_y) = (world.scattering(&z.vertex), world.scattering(&y.vertex));
        let (Some(of_z), Some(of_y)) = (of_z, of_y) else { return Rgb::ZERO };
        let d = y.vertex.x - z.vertex.x;
        let r2 = d.length_squared();
        if r2 == 0.0 {
            return Rgb::ZERO;
        }
        let r = Real::sqrt(r2);
        let w = d / r;
        let f = RadianceMode::value(&of_z, z.from, w) * ImportanceMode::value(&of_y, y.from, -w);
        let light = z.weight() * y.weight() * f;
        if light.is_zero() {
            return Rgb::ZERO;
        }
        let target = y.vertex.surface().map(|s| s.prim);
        let Some((passed, attenuation)) = tracer.passed(&z.vertex, w, r, target) else {
            return Rgb::ZERO;
        };
        let [at_z, at_y] = [z.cosine(w) / r2, y.cosine(w) / r2];
        let [back_z, back_y] =
            [self.camera.back(&of_z, w, z.from), self.light.back(&of_y, -w, y.from)];
        let of_light = square(of_z.pdf(z.from, w, Given::Wo) * at_y) * y.ratios.all(back_y);
        let of_camera = square(of_y.pdf(y.from, -w, Given::Wi) * at_z) * z.ratios.all(back_z);
        let weight = 1.0 / (1.0 + square(attenuation) * (of_light + of_camera));
        light * passed * (weight / r2)
    }

    /// A vertex of the light's path as the camera sees it.
    fn seen(&self, tracer: &mut Tracer<'w>, y: &SubpathVertex) -> Option<Splat> {
        #[cfg(all(test, feature = "std"))]
        if self.fault == Some(tests::Fault::NoSplats) {
            return None;
        }
        let world = self.world;
        let scattering = world.scattering(&y.vertex)?;
        let (wo, transport) = tracer.see(&y.vertex)?;
        let f = ImportanceMode::value(&scattering, y.from, wo);
        let light = y.weight() * f;
        if light.is_zero() {
            return None;
        }
        let distance = (world.camera.position() - y.vertex.x).length();
        let (passed, attenuation) = tracer.passed(&y.vertex, wo, distance, None)?;
        let back = self.light.back(&scattering, wo, y.from);
        let film = transport * y.cosine(wo) / self.light_paths;
        let others = square(film * attenuation) * y.ratios.all(back);
        let weight = 1.0 / (1.0 + others);
        let value = light * passed * (transport * weight / self.light_paths);
        Some(Splat { point: world.camera.view(y.vertex.x).pixel, value, weight: 0.0 })
    }
}

impl Tracer<'_> {
    /// What passes from a vertex to a point, and its [proxy](proxy_attenuation); `None` where a surface other than the `target` is
    /// in the way, or nothing passes.
    fn passed(
        &mut self,
        from: &Vertex,
        dir: Vec3,
        distance: f64,
        target: Option<u32>,
    ) -> Option<(Rgb, f64)> {
        let Self { world, shadow, counters, rng, .. } = self;
        if !world.connect(from, dir, distance, target, shadow, counters) {
            return None;
        }
        let passed = world.transmittance(from.x, dir, shadow, rng, counters);
        let attenuation = proxy_attenuation(world, shadow.medium, &shadow.crossings, distance);
        (!passed.is_zero()).then_some((passed, attenuation))
    }
}
