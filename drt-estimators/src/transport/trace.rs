//! The path tracer: the one random walk from the camera's side, forward and recorded.
//!
//! It estimates, for a vertex x_1 seen along a camera ray (2021 paper, Eqs. 7–11 in solid-angle and
//! distance form),
//!
//! ```text
//! L(x_0 ← x_1) = sum over k of  Θ_k [ e_k + σ_k ( NEE_k ) ],   Θ_{k+1} = Θ_k σ_k s_k a_{k+1}
//! ```
//!
//! | symbol | code | meaning |
//! |---|---|---|
//! | Θ_k | `throughput` | everything sampled before vertex k, its arrival included |
//! | a_k | `arrival` | transmittance over the density (or probability) of the distance |
//! | σ_k | `Coefficients::sigma_s` | scattering coefficient at a volume vertex, 1 on surfaces |
//! | s_k | `value · inv_pdf` | BSDF with cosine, or phase function, over the direction's density |
//! | e_k | | emission met, weighted against next-event estimation |
//!
//! Every choice is made in plain numbers and never differentiated; an [`Observer`] that records
//! sees each factor apart, so that a factor which is zero can still be differentiated (theory sheet
//! §14.5).

use alloc::boxed::Box;

use drt_math::{Rgb, Rng, Vec3, warp};
use drt_medium::Coefficients;

use super::flight::{Flight, Flown, Travel, medium_span};
use super::lights::{LightKind, LightSample, LightTable};
use super::vertex::{Kind, SurfacePoint, Vertex};
use super::world::{Crossing, RayPath, World};
use crate::Counters;
use crate::radiative::Options;
use crate::surface::Given;

/// Longest path with unlimited depth: far beyond where Russian roulette lets any path go.
const LONGEST: u32 = 1 << 20;

/// A vertex of the path, or the environment it escaped to, as the walk arrives there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    pub(crate) parent: u32,
    pub(crate) end: Endpoint,
    /// Unit, from the parent.
    pub(crate) dir: Vec3,
    /// Infinite on escape.
    pub(crate) distance: f64,
    pub(crate) start_medium: Option<usize>,
    pub(crate) arrival: Rgb,
    pub(crate) throughput: Rgb,
    /// MIS weight of the emission met here; 0 where none counts.
    pub(crate) emission_weight: f64,
}

/// Where a segment ends.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Endpoint {
    /// A surface.
    Surface(Vertex),
    /// A volume vertex with the local coefficients.
    Volume(Vertex, Coefficients),
    /// The environment.
    Environment,
}

/// A next-event connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Connection {
    pub(crate) light: LightSample,
    pub(crate) start_medium: Option<usize>,
    /// Scattering value towards the light.
    pub(crate) f: Rgb,
    /// Transmittance × MIS weight / density.
    pub(crate) transport: Rgb,
}

impl Connection {
    /// Everything but the scattering function.
    pub(crate) fn rest(&self) -> Rgb {
        self.transport * self.light.value
    }
}

/// What listens to a walk.
pub(crate) trait Observer {
    /// True when zero factors must not end a path, because their derivatives count.
    const RECORDS: bool;
    /// Light that reached the walk's start over `segments` segments.
    fn contribution(&mut self, segments: u32, value: Rgb);
    /// The walk is about to follow a ray.
    fn ray(&mut self, _world: &World, _leaving: &Leaving, _ray: &RayPath) {}
    /// The walk arrived somewhere; returns the name by which the walk refers to it.
    fn arrive(&mut self, _world: &World, _arrival: &Arrival, _crossings: &[Crossing]) -> u32 {
        0
    }
    /// The walk leaves a vertex, with a value of its scattering function and its inverse density; what it draws
    /// next is `rng`'s.
    fn scatter(
        &mut self,
        _world: &World,
        _leaving: &Leaving,
        _value: Rgb,
        _inv_pdf: f64,
        _rng: &Rng,
    ) {
    }
    /// `node` was connected to a light.
    fn connect(&mut self, _node: u32, _connection: &Connection, _crossings: &[Crossing]) {}
}

/// A vertex about to scatter.
#[derive(Clone, Copy, Debug)]
struct Stop {
    node: u32,
    vertex: Vertex,
    coefficients: Option<Coefficients>,
    wo: Vec3,
    throughput: Rgb,
    /// Arrival weight not yet in `alive`.
    arrival: Rgb,
    alive: Alive,
    segments: u32,
    /// How the vertex's distance was sampled, where equiangular sampling competes.
    flight: Option<Flight>,
}

/// The throughput with at most one zero factor per channel left out: what a derivative can still
/// bring back.
#[derive(Clone, Copy, Debug)]
struct Alive {
    value: Rgb,
    spared: [bool; 3],
}

impl Alive {
    fn new(value: Rgb) -> Self {
        Self { value, spared: [false; 3] }
    }
    fn times(mut self, factor: Rgb, spare: bool) -> Self {
        let mut v = self.value.to_array();
        for (c, f) in factor.to_array().into_iter().enumerate() {
            if f == 0.0 && spare && !self.spared[c] {
                self.spared[c] = true;
            } else {
                v[c] *= f;
            }
        }
        self.value = v.into();
        self
    }
}

/// A ray about to be followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leaving {
    pub(crate) node: u32,
    pub(crate) vertex: Vertex,
    pub(crate) dir: Vec3,
    /// Solid-angle density of `dir`, where next-event estimation competes.
    pdf: Option<f64>,
    pub(crate) throughput: Rgb,
    alive: Alive,
    /// Segments before the ray.
    pub(crate) segments: u32,
}

impl Leaving {
    /// The density of its direction.
    pub(crate) fn pdf(&self) -> Option<f64> {
        self.pdf
    }

    /// Another direction of a given density, whose light counts so many `times` for Russian roulette but is not
    /// multiplied by anything.
    pub(crate) fn turned(&self, dir: Vec3, pdf: f64, times: f64) -> Self {
        let alive = Alive { value: self.alive.value * times, ..self.alive };
        Self { node: 0, dir, pdf: Some(pdf), throughput: Rgb::ONE, alive, ..*self }
    }
}

/// Everything one walk needs: the scene, its random numbers and reusable buffers.
pub(crate) struct Tracer<'w> {
    pub(crate) world: &'w World,
    pub(crate) rng: Rng,
    pub(crate) counters: Counters,
    /// Longest path in segments.
    pub(crate) max_segments: u32,
    /// Boxed, as it is lent out for every segment.
    pub(crate) ray: Option<Box<RayPath>>,
    pub(crate) shadow: RayPath,
    /// Edges to look at.
    pub(crate) options: Options,
}

impl<'w> Tracer<'w> {
    pub(crate) fn new(world: &'w World) -> Self {
        Self {
            world,
            rng: Rng::new(0, 0, 0),
            counters: Counters::default(),
            max_segments: world.max_depth.min(LONGEST),
            ray: None,
            shadow: RayPath::default(),
            options: Options::default(),
        }
    }

    /// Traces a camera ray; `weight` is the filter over the density of the image point.
    pub(crate) fn trace_camera<O: Observer>(&mut self, dir: Vec3, weight: Rgb, observer: &mut O) {
        self.counters.paths += 1;
        let leaving = Leaving {
            node: 0,
            vertex: self.world.eye(),
            dir,
            pdf: None,
            throughput: weight,
            // Roulette must not end paths for the filter's sake: its derivative needs them.
            alive: Alive::new(Rgb::ONE),
            segments: 0,
        };
        self.radiance_along(&leaving, observer);
    }

    /// Estimates what comes along a ray, times its throughput.
    pub(crate) fn radiance_along<O: Observer>(&mut self, leaving: &Leaving, observer: &mut O) {
        if let Some(stop) = self.follow(leaving, observer) {
            self.walk(stop, observer);
        }
    }

    /// Estimates what leaves `vertex` along the unit direction `wo`: radiance at a surface, radiance
    /// per length (scattered and emitted) at a volume vertex.
    pub(crate) fn radiance_from<O: Observer>(
        &mut self,
        vertex: Vertex,
        wo: Vec3,
        observer: &mut O,
    ) {
        let coefficients = match &vertex.kind {
            Kind::Surface(s) => {
                let emitted = self.world.emitted(s, wo);
                if !emitted.is_zero() {
                    observer.contribution(0, emitted);
                }
                None
            }
            Kind::Volume(_) => {
                let Some(m) = vertex.medium else { return };
                let c = self.world.coefficients(m, vertex.x);
                observer.contribution(0, c.source());
                Some(c)
            }
            Kind::Point => return,
        };
        let stop = Stop {
            node: 0,
            vertex,
            coefficients,
            wo,
            throughput: Rgb::ONE,
            arrival: Rgb::ONE,
            alive: Alive::new(Rgb::ONE),
            segments: 0,
            flight: None,
        };
        self.walk(stop, observer);
    }

    /// The same over at most `longest` segments.
    pub(crate) fn radiance_within<O: Observer>(
        &mut self,
        longest: u32,
        vertex: Vertex,
        wo: Vec3,
        observer: &mut O,
    ) {
        let own = core::mem::replace(&mut self.max_segments, longest);
        self.radiance_from(vertex, wo, observer);
        self.max_segments = own;
    }

    fn walk<O: Observer>(&mut self, mut stop: Stop, observer: &mut O) {
        while let Some(leaving) = self.scatter(&stop, observer) {
            match self.follow(&leaving, observer) {
                Some(next) => stop = next,
                None => return,
            }
        }
    }

    /// Connects the vertex to a light and draws where the path goes on.
    fn scatter<O: Observer>(&mut self, stop: &Stop, observer: &mut O) -> Option<Leaving> {
        if stop.segments >= self.max_segments {
            return None;
        }
        let world = self.world;
        let scattering = world.scattering(&stop.vertex)?;
        let sigma_s = stop.coefficients.as_ref().map_or(Rgb::ONE, Coefficients::sigma_s);
        let spare = O::RECORDS && world.may_revive(&stop.vertex);
        if stop.alive.times(stop.arrival * sigma_s, spare).value.is_zero() {
            return None;
        }
        if let Some(light) = world.lights.sample(world, stop.vertex.x, &mut self.rng) {
            let weight = match light.kind {
                LightKind::Position => self.free_flight_weight(stop, &light),
                LightKind::Direction => 1.0,
                LightKind::Area(_) => {
                    let p = scattering.pdf(stop.wo, light.w, Given::Wo);
                    light.pdf / (light.pdf + p)
                }
            };
            self.connect(stop, &light, weight, sigma_s, observer);
        }
        let (wi, pdf) = scattering.sample(stop.wo, Given::Wo, &mut self.rng)?;
        if pdf.is_nan() || pdf <= 0.0 {
            return None;
        }
        let value = scattering.eval(stop.wo, wi);
        let mut inv_pdf = 1.0 / pdf;
        let mut alive = stop.alive.times(stop.arrival * sigma_s * (value * inv_pdf), spare);
        if alive.value.is_zero() {
            return None;
        }
        if stop.segments >= world.rr_depth {
            let survival = world.survival(alive.value);
            if self.rng.next_f64() >= survival {
                return None;
            }
            inv_pdf /= survival;
            alive.value *= 1.0 / survival;
        }
        let leaving = Leaving {
            node: stop.node,
            vertex: stop.vertex,
            dir: wi,
            pdf: Some(pdf),
            throughput: stop.throughput * sigma_s * (value * inv_pdf),
            alive,
            segments: stop.segments,
        };
        observer.scatter(world, &leaving, value, inv_pdf, &self.rng);
        Some(leaving)
    }

    /// MIS weight of connecting to a point light from a vertex that free flight found.
    fn free_flight_weight(&self, stop: &Stop, light: &LightSample) -> f64 {
        let (lights, total) = self.world.lights.inside();
        match &stop.flight {
            Some(flight) if lights.iter().any(|(e, _, _)| *e == light.emitter) => {
                flight.weight(light.y, total)
            }
            _ => 1.0,
        }
    }

    /// Adds the light of one sampled emitter point, scattered at `stop`.
    fn connect<O: Observer>(
        &mut self,
        stop: &Stop,
        light: &LightSample,
        weight: f64,
        sigma_s: Rgb,
        observer: &mut O,
    ) {
        let world = self.world;
        let Some(scattering) = world.scattering(&stop.vertex) else { return };
        let f = scattering.eval(stop.wo, light.w);
        let spare = O::RECORDS && world.may_revive(&stop.vertex);
        if weight == 0.0 || (f.is_zero() && !spare) {
            return;
        }
        let target = match &light.kind {
            LightKind::Area(s) => Some(s.prim),
            _ => None,
        };
        let (v, w, d) = (&stop.vertex, light.w, light.distance);
        if !world.connect(v, w, d, target, &mut self.shadow, &mut self.counters) {
            return;
        }
        let tau = world.transmittance(v.x, w, &self.shadow, &mut self.rng, &mut self.counters);
        let transport = tau * (weight * light.inv_pdf);
        if transport.is_zero() {
            return;
        }
        let start_medium = self.shadow.medium;
        let connection = Connection { light: *light, start_medium, f, transport };
        let value = stop.throughput * sigma_s * f * connection.rest();
        observer.contribution(stop.segments + 1, value);
        observer.connect(stop.node, &connection, &self.shadow.crossings);
    }

    /// Follows a ray to its next vertex.
    fn follow<O: Observer>(&mut self, leaving: &Leaving, observer: &mut O) -> Option<Stop> {
        let origin = leaving.vertex.x;
        let mut ray = self.ray.take().unwrap_or_default();
        self.world.cast(&leaving.vertex, leaving.dir, &mut ray, &mut self.counters);
        observer.ray(self.world, leaving, &ray);
        let span = self.equiangular(leaving, &ray, observer);
        let stop = match self.travel(origin, leaving.dir, &ray, leaving.alive.value) {
            Travel::Absorbed => None,
            Travel::Volume(v) => {
                let flight = span.map(|span| v.flight(span, origin, leaving.dir));
                Some(self.pause(leaving, &ray, &v, flight, 1.0, observer))
            }
            Travel::Surface(point, x, arrival) => {
                Some(self.land(leaving, &ray, point, x, arrival, observer))
            }
            Travel::Escape(arrival) => {
                self.escape(leaving, &ray, arrival, observer);
                None
            }
        };
        self.ray = Some(ray);
        stop
    }

    /// Arrives at a volume vertex, whose own emission counts by `emission_weight`.
    fn pause<O: Observer>(
        &mut self,
        leaving: &Leaving,
        ray: &RayPath,
        v: &Flown,
        flight: Option<Flight>,
        emission_weight: f64,
        observer: &mut O,
    ) -> Stop {
        let segments = leaving.segments + 1;
        let throughput = leaving.throughput * v.arrival;
        let source = v.coefficients.source() * emission_weight;
        if !source.is_zero() {
            observer.contribution(segments, throughput * source);
        }
        let record = Arrival {
            parent: leaving.node,
            end: Endpoint::Volume(v.vertex, v.coefficients),
            dir: leaving.dir,
            distance: v.t,
            start_medium: ray.medium,
            arrival: v.arrival,
            throughput,
            emission_weight,
        };
        let node = observer.arrive(self.world, &record, &ray.crossings[..v.crossed]);
        Stop {
            node,
            vertex: v.vertex,
            coefficients: Some(v.coefficients),
            wo: -leaving.dir,
            throughput,
            arrival: v.arrival,
            alive: leaving.alive,
            segments,
            flight,
        }
    }

    fn land<O: Observer>(
        &mut self,
        leaving: &Leaving,
        ray: &RayPath,
        point: SurfacePoint,
        x: Vec3,
        arrival: Rgb,
        observer: &mut O,
    ) -> Stop {
        let segments = leaving.segments + 1;
        let medium = ray.crossings.last().map_or(ray.medium, |c| c.after);
        let vertex = Vertex { x, medium, kind: Kind::Surface(point) };
        let throughput = leaving.throughput * arrival;
        let emitted = self.world.emitted(&point, -leaving.dir);
        let mut emission_weight = 0.0;
        // A black emitter with a moving radiance must be recorded too, so the weight does not
        // depend on the value being nonzero.
        if self.world.scene.shapes[point.shape as usize].emitter.is_some() {
            let light = self.world.lights.area_pdf(&point, leaving.dir, ray.length);
            emission_weight = leaving.pdf.map_or(1.0, |p| p / (p + light));
            observer.contribution(segments, throughput * emitted * emission_weight);
        }
        let record = Arrival {
            parent: leaving.node,
            end: Endpoint::Surface(vertex),
            dir: leaving.dir,
            distance: ray.length,
            start_medium: ray.medium,
            arrival,
            throughput,
            emission_weight,
        };
        let node = observer.arrive(self.world, &record, &ray.crossings);
        Stop {
            node,
            vertex,
            coefficients: None,
            wo: -leaving.dir,
            throughput,
            arrival,
            alive: leaving.alive,
            segments,
            flight: None,
        }
    }

    fn escape<O: Observer>(
        &mut self,
        leaving: &Leaving,
        ray: &RayPath,
        arrival: Rgb,
        observer: &mut O,
    ) {
        let Some((_, radiance)) = self.world.lights.environment() else { return };
        let throughput = leaving.throughput * arrival;
        observer.contribution(leaving.segments + 1, throughput * radiance);
        let record = Arrival {
            parent: leaving.node,
            end: Endpoint::Environment,
            dir: leaving.dir,
            distance: f64::INFINITY,
            start_medium: ray.medium,
            arrival,
            throughput,
            emission_weight: 1.0,
        };
        observer.arrive(self.world, &record, &ray.crossings);
    }

    /// Scatters light of a point light at a distance chosen by the angle it is seen under (Kulla and
    /// Fajardo 2012): free-flight sampling alone has infinite variance near a light inside a medium
    /// (theory sheet §14.2). Returns the part of the ray it covers.
    fn equiangular<O: Observer>(
        &mut self,
        leaving: &Leaving,
        ray: &RayPath,
        observer: &mut O,
    ) -> Option<(f64, f64)> {
        let world = self.world;
        let (lights, total) = world.lights.inside();
        if lights.is_empty() || leaving.segments + 2 > self.max_segments {
            return None;
        }
        let span = medium_span(ray)?;
        let u = [self.rng.next_f64(), self.rng.next_f64()];
        let (emitter, pmf, at) = pick(lights, total, u[0]);
        let origin = leaving.vertex.x;
        let distances = warp::Equiangular::new(origin, leaving.dir, at, span.0, span.1);
        let t = distances.sample(u[1]);
        // Per unit of selection probability, as free-flight sampling sees every light.
        let density = distances.pdf(t) / total;
        let mut part = core::mem::take(&mut self.shadow);
        part.truncate_from(ray, t);
        let placed = self.place(origin, leaving.dir, &part, t, density);
        // The emission here is left to free flight.
        let stop = placed.map(|v| self.pause(leaving, &part, &v, None, 0.0, observer));
        self.shadow = part;
        if let Some(stop) = stop
            && let Some(light) = LightTable::delta(world, emitter, stop.vertex.x, pmf)
        {
            let sigma_s = stop.coefficients.as_ref().map_or(Rgb::ZERO, Coefficients::sigma_s);
            self.connect(&stop, &light, 1.0, sigma_s, observer);
        }
        Some(span)
    }
}

fn pick(lights: &[(usize, f64, Vec3)], total: f64, u: f64) -> (usize, f64, Vec3) {
    let mut target = u * total;
    for l in lights {
        target -= l.1;
        if target < 0.0 {
            return *l;
        }
    }
    lights[lights.len() - 1]
}
