//! Paths from both ends (Veach 1997, chapter 10; Lafortune and Willems 1993).
//!
//! A path z_0 … z_{t-1} from the camera and a path y_0 … y_{s-1} from an emitter are connected in every way: each
//! prefix of one with each prefix of the other. A complete path of n segments is found by n + 1 of these strategies (s,
//! t), whose contributions are weighted by the power heuristic with exponent 2:
//!
//! | s, t | connection |
//! |---|---|
//! | 0, t | none: the camera path hits an emitter or a medium that emits, or leaves the scene |
//! | 1, t | next-event estimation: a point on an emitter is chosen for the vertex |
//! | s, 1 | the vertex of the light path is connected to the camera, and splatted; for an orthographic camera along its one direction |
//! | s, t | the two vertices are connected |
//!
//! # Weights
//!
//! In measures of area and volume the density of a strategy is a product over its vertices of the density of the
//! direction that led there, the cosine there (1 in a volume) over the squared distance, the transmittance τ of the
//! segment, and in a volume σ_t. Every inner vertex is sampled from one side or the other, so σ_t is in all strategies'
//! densities and cancels; the transmittance of a segment is in the densities of all strategies except the one that
//! connects along this segment. Ratios of densities need τ of single segments only. In grids τ has no closed form:
//! there, and for colours, a [proxy](proxy_attenuation) is used in place of it, in all strategies alike. So weights add
//! up to 1 for any medium, and are best where the proxy is exact.
//!
//! Sums over strategies are passed on from vertex to vertex (Georgiev 2012; van Antwerpen 2011). Let p be the density
//! of the direction in which the path left a vertex, p' that of the reverse direction, r the length of the segment, and
//! c the cosine at the vertex where it arrives. Then
//!
//! ```text
//! at the start      d = p_connect / p_start,                  e = c_0 / p_start (0 of what has no area)
//! scattering        e ← (c/p) (e p' + d),                     d ← 1/p
//! smooth surfaces   e ← c e,                                  d ← 0
//! arriving          d ← d r² / (c τ),                         e ← e / c
//! ```
//!
//! with all numbers squared except the densities of one strategy. d p stands for connecting along the last segment
//! instead of sampling it, e for connecting along an earlier one. The weight of a strategy is 1 / (1 + a_y + a_z) with
//!
//! ```text
//! connection        a_y = τ² p_z(→y)² (c_y/r²)² (d_y + e_y p'_y²), and a_z likewise
//! next event        a_y = τ² (p_z / p_light)²,       a_z = τ² (p_flow c/r²)² (d_z + e_z p'_z²)
//! camera            a_y = τ² (p_film c/r²)² (d_y + e_y p'_y²) / n²
//! emission met      a_z = p_light² d_z + p_start² e_z
//! ```
//!
//! where n is the number of light paths for one sample of every pixel, which is the number of pixels, and p_film c/r²
//! is a density per area for every kind of camera. The probabilities of Russian roulette are left out of all densities.
//!
//! A lens is a pinhole for each of its points (`sensor::aperture`), which all strategies sample with one density. So
//! this density cancels in their weights, and both paths of a sample use one point of the lens.
//!
//! # Records
//!
//! A [`JointObserver`] receives what is to be differentiated: the camera path, next-event connections, and each
//! connection with a vertex of the light path, which is reversed as a [`LightPath`]. Weights are functions of the path
//! alone, so they are factors of connections, as densities are, and are not differentiated. Connections of light path
//! vertices to the camera are recorded one by one, for the pixels on which they land.

mod emission;
mod subpath;
#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;
use core::marker::PhantomData;

use drt_math::{Ray, Real, Rgb, Vec3};

use crate::model::sensor::{Sensor, ViewSample};
use crate::model::surface::Given;
pub(crate) use crate::sampling::bidirectional::emission::EmissionSampler;
use crate::sampling::bidirectional::emission::{EmittedRay, area_flow_pdf};
use crate::sampling::bidirectional::subpath::{
    Observed, Ratios, Segment, Subpath, SubpathVertex, Unconnected, Unobserved, square,
};
use crate::sampling::film::{Splat, SplatDensity};
use crate::sampling::flight::proxy_attenuation;
use crate::sampling::importance::see;
use crate::sampling::record::{
    Joint, JointObserver, LightPath, LightVertex, Radiance, Scattered, SeenVertex,
};
use crate::sampling::trace::{Arrival, Connection, OutgoingRay, Tracer};
use crate::sampling::transport_mode::{ImportanceMode, RadianceMode, TransportMode};
use crate::world::lights::LightKind;
use crate::world::vertex::Vertex;
use crate::world::{Crossing, World};

/// The cosine of what lies in a surface's plane, but for rounding.
const IN_PLANE: f64 = 1e-12;

/// Joins paths from both ends.
pub(crate) struct Bidirectional<'w> {
    world: &'w World,
    emission: &'w EmissionSampler,
    /// Light paths to one sample of each pixel.
    light_paths: f64,
    camera: Subpath,
    light: Subpath,
    /// The light path as it is recorded.
    recorded: LightPath,
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
            recorded: LightPath::default(),
        }
    }

    /// Traces a path from either end. Returns what comes along the camera's ray, times its `weight`; what reaches the
    /// film elsewhere is added to `splats`. The observer is told of all but these.
    pub(crate) fn trace<O: JointObserver>(
        &mut self,
        tracer: &mut Tracer<'w>,
        view: &ViewSample,
        weight: Rgb,
        splats: &mut Vec<Splat>,
        observer: &mut O,
    ) -> Rgb {
        self.trace_camera(tracer, view, weight, observer);
        self.trace_light::<O>(tracer);
        self.join(tracer, view, splats, observer)
    }

    /// Joins the two paths that have been traced, by all strategies.
    fn join<O: JointObserver>(
        &mut self,
        tracer: &mut Tracer<'w>,
        view: &ViewSample,
        splats: &mut Vec<Splat>,
        observer: &mut O,
    ) -> Rgb {
        let mut sum = self.camera.met;
        for k in 0..self.camera.vertices.len() {
            let z = self.camera.vertices[k];
            sum += self.met(&z, k, observer);
            if z.segments >= tracer.max_segments {
                continue;
            }
            sum += self.next_event(tracer, &z, k, observer);
            for y in 0..self.light.vertices.len() {
                if z.segments + self.light.vertices[y].segments < tracer.max_segments {
                    sum += self.connection(tracer, &z, [k, y], observer);
                }
            }
        }
        observer.joined(&self.recorded);
        let camera = &*self.world.camera.at_lens(view.lens);
        for y in 0..self.light.vertices.len() {
            let seen = self.seen::<Radiance>(tracer, (camera, view.lens), y);
            splats.extend(seen.map(|seen| seen.splat(self.light_paths)));
        }
        sum
    }

    /// Traces a light path alone, as `O` would observe it, and adds the vertices that the camera sees.
    pub(crate) fn trace_to_camera<O: JointObserver>(
        &mut self,
        tracer: &mut Tracer<'w>,
        seen: &mut Vec<SeenFromCamera>,
    ) {
        tracer.counters.paths += 1;
        let lens = self.world.camera.draw_lens(&mut tracer.rng);
        let camera = &*self.world.camera.at_lens(lens);
        self.trace_light::<O>(tracer);
        for y in 0..self.light.vertices.len() {
            seen.extend(self.seen::<O>(tracer, (camera, lens), y));
        }
    }

    /// Tells an observer, which has begun with the camera, of a vertex that it sees of the last light path.
    pub(crate) fn record_seen<O: JointObserver>(&self, seen: &SeenFromCamera, observer: &mut O) {
        let leaving = Scattered { value: Rgb::ONE, inv_pdf: 1.0 };
        let SeenFromCamera { vertex, arrival, scattered, ref crossings, .. } = *seen;
        let joint = Joint { vertex, leaving, arrival, crossings, scattered };
        observer.join(&joint, &self.recorded);
        observer.joined(&self.recorded);
    }

    fn trace_camera<O: JointObserver>(
        &mut self,
        tracer: &mut Tracer<'w>,
        view: &ViewSample,
        weight: Rgb,
        observer: &mut O,
    ) {
        let leaving = tracer.camera_ray(view, weight);
        let camera = &*self.world.camera.at_lens(view.lens);
        let film = camera.view(view.origin + view.direction).importance;
        let ratios = Ratios { last: square(self.light_paths / film), earlier: 0.0 };
        // Parallel rays are drawn by area, as if they came from infinity.
        self.camera.begin(ratios, !camera.viewpoint().is_at_infinity());
        type Mode = Unconnected<RadianceMode>;
        let mut observed = Observed { subpath: &mut self.camera, observer };
        if let Some(first) = tracer.follow::<Mode, _>(&leaving, &mut observed) {
            tracer.walk::<Mode, _>(first, &mut observed);
        }
    }

    /// Traces a light path, as `O` would observe paths.
    fn trace_light<O: JointObserver>(&mut self, tracer: &mut Tracer<'w>) {
        self.light.begin(Ratios::default(), true);
        self.recorded.clear();
        // Walks of importance end a segment earlier than what they are connected to.
        if tracer.max_segments < 2 {
            return;
        }
        let Some(start) = self.emission.sample(self.world, &mut tracer.rng) else { return };
        let ratios = Ratios { last: 1.0 / square(start.pdf), earlier: square(start.inv_start) };
        self.light.begin(ratios, start.finite);
        let leaving = OutgoingRay::starting(start.vertex, start.dir, start.throughput);
        type Mode = Unconnected<ImportanceMode>;
        let observer = &mut Unobserved::<O>(PhantomData);
        let mut observed = Observed { subpath: &mut self.light, observer };
        if let Some(first) = tracer.follow::<Mode, _>(&leaving, &mut observed) {
            tracer.walk::<Mode, _>(first, &mut observed);
        }
        if O::RECORDS {
            self.record_light(&start);
        }
    }

    /// Turns the light path round.
    fn record_light(&mut self, start: &EmittedRay) {
        let Self { world, light, recorded, .. } = self;
        for (i, (v, segment)) in light.vertices.iter().zip(&light.arrivals).enumerate() {
            let Segment { arrival, distance, start_medium, .. } = *segment;
            let crossings = &light.crossings[segment.crossings.clone()];
            let (crossings, medium) = recorded.turn_round(crossings, start_medium, distance);
            let before = i.checked_sub(1).and_then(|i| Some((i, recorded.vertices.get_mut(i)?)));
            if let Some((i, before)) = before {
                let y = &light.vertices[i];
                let scattering = world.scattering(&y.vertex);
                before.seen = scattering.map(|scattering| SeenVertex {
                    dir: v.from,
                    distance,
                    start_medium: medium,
                    crossings,
                    arrival,
                    scattered: y.scattered(&scattering, -v.from, light.arrivals[i].inv_pdf),
                });
            } else if let Some((light, inv_pdf)) = start.seen_from(world, v.vertex.x) {
                let transport = arrival * inv_pdf;
                let emission = Connection { light, start_medium: medium, f: Rgb::ZERO, transport };
                (recorded.emission, recorded.crossed) = (Some(emission), crossings);
            }
            recorded.vertices.push(LightVertex { end: v.end(), wi: v.from, seen: None });
        }
    }

    /// The emission of a surface that the camera's path meets, at once or later.
    fn met<O: JointObserver>(&self, z: &SubpathVertex, index: usize, observer: &mut O) -> Rgb {
        let Some(s) = z.vertex.surface().filter(|s| self.world.emits(s)) else { return Rgb::ZERO };
        let mut weight = 1.0;
        // Nothing else finds what is seen at once.
        if index > 0 {
            let per_area = self.world.lights.area_density(s);
            let start = per_area * area_flow_pdf(s, z.from);
            let others = square(per_area) * z.ratios.last + square(start) * z.ratios.earlier;
            weight = 1.0 / (1.0 + others);
        }
        observer.emission(name(index), weight);
        z.throughput * self.world.emitted(s, z.from) * weight
    }

    /// Next-event estimation.
    fn next_event<O: JointObserver>(
        &self,
        tracer: &mut Tracer<'w>,
        z: &SubpathVertex,
        index: usize,
        observer: &mut O,
    ) -> Rgb {
        let world = self.world;
        let Some(scattering) = world.scattering(&z.vertex) else { return Rgb::ZERO };
        let light = world.lights.sample(world, z.vertex.x, &mut tracer.rng);
        let Some(light) = light else { return Rgb::ZERO };
        let f = RadianceMode::value(&scattering, z.from, light.w);
        if f.is_zero() && !(O::RECORDS && world.may_revive(&z.vertex)) {
            return Rgb::ZERO;
        }
        let target = light.point().map(|s| s.prim);
        let Some((passed, attenuation)) = tracer.passed(&z.vertex, light.w, light.distance, target)
        else {
            return Rgb::ZERO;
        };
        let hit = match light.kind {
            LightKind::Area(_) | LightKind::Environment => {
                scattering.pdf(z.from, light.w, Given::Wo) * light.inv_pdf
            }
            _ => 0.0,
        };
        let back = self.camera.back(&scattering, light.w, z.from);
        let flow = self.emission.flow_pdf(world, &light) * z.cosine(light.w);
        let others = square(hit) + square(flow) * z.ratios.all(back);
        let weight = 1.0 / (1.0 + square(attenuation) * others);
        let transport = passed * (light.inv_pdf * weight);
        let connection = Connection { light, start_medium: tracer.shadow.medium, f, transport };
        observer.connect(name(index), &connection, &tracer.shadow.crossings);
        z.weight() * f * connection.rest()
    }

    /// The connection of a vertex of the camera path with one of the light path.
    fn connection<O: JointObserver>(
        &self,
        tracer: &mut Tracer<'w>,
        z: &SubpathVertex,
        [of_camera, of_light]: [usize; 2],
        observer: &mut O,
    ) -> Rgb {
        let y = &self.light.vertices[of_light];
        let world = self.world;
        let at = [&z.vertex, &y.vertex].map(|v| world.scattering(v));
        let [Some(of_z), Some(of_y)] = at else { return Rgb::ZERO };
        let d = y.vertex.x - z.vertex.x;
        let r2 = d.length_squared();
        if r2 == 0.0 {
            return Rgb::ZERO;
        }
        let r = Real::sqrt(r2);
        let w = d / r;
        // Points of one plane do not see each other.
        if [z, y].iter().any(|v| v.cosine(w) < IN_PLANE) {
            return Rgb::ZERO;
        }
        let (f, scattered) = (RadianceMode::value(&of_z, z.from, w), y.scattered(&of_y, -w, 1.0));
        let light = z.weight() * y.weight() * f * (scattered.value * scattered.inv_pdf);
        let ends = [(z, f), (y, scattered.value)];
        if light.is_zero() && (!O::RECORDS || ends.iter().any(|(v, f)| self.is_dead(v, *f))) {
            return Rgb::ZERO;
        }
        let target = y.vertex.surface().map(|s| s.prim);
        let Some((passed, attenuation)) = tracer.passed(&z.vertex, w, r, target) else {
            return Rgb::ZERO;
        };
        let [at_z, at_y] = [z.cosine(w) / r2, y.cosine(w) / r2];
        let [back_z, back_y] =
            [self.camera.back(&of_z, w, z.from), self.light.back(&of_y, -w, y.from)];
        let by_camera = square(of_z.pdf(z.from, w, Given::Wo) * at_y) * y.ratios.all(back_y);
        let by_light = square(of_y.pdf(y.from, -w, Given::Wi) * at_z) * z.ratios.all(back_z);
        let weight = 1.0 / (1.0 + square(attenuation) * (by_camera + by_light));
        let leaving = Scattered { value: f, inv_pdf: weight / r2 };
        let arrival = Arrival {
            parent: name(of_camera),
            end: y.end(),
            dir: w,
            distance: r,
            start_medium: tracer.shadow.medium,
            arrival: passed,
            throughput: z.weight() * passed * (f * leaving.inv_pdf),
            emission_weight: 0.0,
        };
        let crossings = &tracer.shadow.crossings[..];
        let joint = Joint { vertex: of_light, leaving, arrival, crossings, scattered };
        observer.join(&joint, &self.recorded);
        light * passed * leaving.inv_pdf
    }

    /// A vertex scatters nothing, with the value `f` of its scattering function, and no derivative of that counts.
    fn is_dead(&self, v: &SubpathVertex, f: Rgb) -> bool {
        (v.sigma_s() * f).is_zero() && !self.world.may_revive(&v.vertex)
    }

    /// A vertex of the light's path as the camera sees it, the pinhole that it is at a point of its lens.
    fn seen<O: JointObserver>(
        &self,
        tracer: &mut Tracer<'w>,
        (camera, lens): (&Sensor, [f64; 2]),
        vertex: usize,
    ) -> Option<SeenFromCamera> {
        let y = &self.light.vertices[vertex];
        let world = self.world;
        let scattering = world.scattering(&y.vertex)?;
        let (wo, transport) = see(camera, &y.vertex)?;
        if y.cosine(wo) < IN_PLANE {
            return None;
        }
        let scattered = y.scattered(&scattering, wo, 1.0);
        let light = y.weight() * (scattered.value * scattered.inv_pdf);
        if light.is_zero() && (!O::RECORDS || self.is_dead(y, scattered.value)) {
            return None;
        }
        let eye = world.eye_at(camera.eye_of(y.vertex.x));
        let distance = (eye.x - y.vertex.x).length();
        let target = y.vertex.surface().map(|s| s.prim);
        let (passed, attenuation) = tracer.passed(&eye, -wo, distance, target)?;
        let back = self.light.back(&scattering, wo, y.from);
        let film = transport * y.cosine(wo) / self.light_paths;
        let others = square(film * attenuation) * y.ratios.all(back);
        let weight = 1.0 / (1.0 + others);
        let weight = transport * weight;
        let arrival = Arrival {
            parent: 0,
            end: y.end(),
            dir: -wo,
            distance,
            start_medium: tracer.shadow.medium,
            arrival: passed,
            throughput: passed * weight,
            emission_weight: 0.0,
        };
        Some(SeenFromCamera {
            vertex,
            view: ViewSample {
                origin: eye.x,
                direction: -wo,
                point: camera.view(y.vertex.x).pixel,
                weight,
                slope: [0.0; 2],
                lens,
            },
            value: light * arrival.throughput,
            arrival,
            crossings: if O::RECORDS { tracer.shadow.crossings.clone() } else { Vec::new() },
            scattered,
        })
    }
}

/// A vertex of a light path as the camera sees it.
pub(crate) struct SeenFromCamera {
    vertex: usize,
    /// Its ray; the weight is the camera's importance without a filter, over the squared distance and times the MIS
    /// weight.
    pub(crate) view: ViewSample,
    /// What arrives.
    value: Rgb,
    arrival: Arrival,
    /// On the way, where it is recorded.
    crossings: Vec<Crossing>,
    scattered: Scattered,
}

impl SeenFromCamera {
    /// On the film, of one of so many light paths.
    fn splat(&self, light_paths: f64) -> Splat {
        Splat {
            point: self.view.point,
            value: self.value * (1.0 / light_paths),
            weight: 0.0,
            density: SplatDensity::Known,
        }
    }
}

/// The number that the observer of the walk uses for a vertex of the camera path.
fn name(vertex: usize) -> u32 {
    vertex as u32 + 1
}

impl Tracer<'_> {
    /// What passes from a vertex to a point, and its [proxy](proxy_attenuation); `None` where a surface other than the
    /// `target` is in the way, or nothing passes.
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
        let passed = world.transmittance(&Ray::new(from.x, dir), shadow, rng, counters);
        let attenuation = proxy_attenuation(world, shadow.medium, &shadow.crossings, distance);
        (!passed.is_zero()).then_some((passed, attenuation))
    }
}
