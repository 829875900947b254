//! The one random walk, in either [`TransportMode`]: connect, scatter, follow a ray, arrive.

use drt_math::{Ray, Rgb, Vec3};
use drt_medium::Coefficients;

use crate::sampling::flight::{Flown, Travel, medium_span};
use crate::sampling::trace::{
    Alive, Arrival, Connection, Endpoint, Flight, Observer, OutgoingRay, PathState, Pixel, Tracer,
};
use crate::sampling::transport_mode::TransportMode;
use crate::world::lights::LightSample;
use crate::world::scatter::Drawn;
use crate::world::vertex::Vertex;
use crate::world::{RayPath, World};

impl Tracer<'_> {
    pub(super) fn walk<M: TransportMode, O: Observer>(
        &mut self,
        mut stop: PathState,
        observer: &mut O,
    ) {
        while let Some(leaving) = self.scatter::<M, O>(&stop, observer) {
            match self.follow::<M, O>(&leaving, observer) {
                Some(next) => stop = next,
                None => return,
            }
        }
    }

    /// Connects the vertex to the other end of paths and draws where this one goes on.
    fn scatter<M: TransportMode, O: Observer>(
        &mut self,
        stop: &PathState,
        observer: &mut O,
    ) -> Option<OutgoingRay> {
        let world = self.world;
        // Going straight on adds no depth, so that the last vertex may do that.
        let mut straight_only = stop.segments >= self.max_segments;
        if straight_only && !(world.any_straight && world.passes_straight(&stop.vertex)) {
            return None;
        }
        let scattering = world.scattering(&stop.vertex)?;
        let sigma_s = stop.coefficients.as_ref().map_or(Rgb::ONE, Coefficients::sigma_s);
        let spare = O::RECORDS && world.may_revive(&stop.vertex);
        if stop.alive.times(stop.arrival * sigma_s, spare).value.is_zero() {
            return None;
        }
        let parted = O::RECORDS && world.parts_directions(&scattering);
        let mut drawn = None;
        if parted {
            drawn = scattering.sample(stop.from, M::GIVEN, &mut self.rng);
        }
        // A path that goes on in a single direction is no path of what is connected, which the others count more often for.
        if !(straight_only || matches!(drawn, Some(Drawn::Specular(_)))) {
            let others = if parted { 1.0 - scattering.single_chance(stop.from) } else { 1.0 };
            self.connected = others.recip();
            M::connect(self, stop, &scattering, sigma_s, observer);
            self.connected = 1.0;
        }
        if stop.segments + 1 >= self.max_segments && !M::EMISSION {
            if !(world.any_straight && world.passes_straight(&stop.vertex)) {
                return None;
            }
            straight_only = true;
        }
        let mut segments = stop.segments;
        if !parted {
            drawn = scattering.sample(stop.from, M::GIVEN, &mut self.rng);
        }
        let mut bent = false;
        let (to, pdf, value) = match drawn? {
            Drawn::Spread(to, pdf) if pdf > 0.0 && !straight_only => {
                (to, Some(pdf), M::value(&scattering, stop.from, to))
            }
            Drawn::Spread(..) => return None,
            Drawn::Specular(s) if straight_only && !s.straight => return None,
            Drawn::Specular(s) => {
                // Like a null interface, a pane that light goes straight through adds no depth.
                segments -= u32::from(s.straight && world.any_straight && segments > 0);
                bent = !s.straight;
                (s.w, None, s.weight)
            }
        };
        let mut inv_pdf = pdf.map_or(1.0, f64::recip);
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
        let leaving = OutgoingRay {
            node: stop.node,
            vertex: stop.vertex,
            dir: to,
            pdf,
            bent,
            throughput: stop.throughput * sigma_s * (value * inv_pdf),
            alive,
            segments,
        };
        observer.scatter(world, &leaving, value, inv_pdf, &self.rng);
        Some(leaving)
    }

    /// Follows a ray to its next vertex.
    pub(super) fn follow<M: TransportMode, O: Observer>(
        &mut self,
        leaving: &OutgoingRay,
        observer: &mut O,
    ) -> Option<PathState> {
        let origin = leaving.vertex.x;
        let mut ray = self.ray.take().unwrap_or_default();
        let (world, counters) = (self.world, &mut self.counters);
        if M::EMISSION && leaving.misses_emitters(world) {
            world.cast_past_emitters(&leaving.vertex, leaving.dir, &mut ray, counters);
        } else if leaving.bent {
            world.cast_bent(&leaving.vertex, leaving.dir, &mut ray, counters);
        } else {
            world.cast(&leaving.vertex, leaving.dir, &mut ray, counters);
        }
        observer.ray(self.world, leaving, &ray);
        let span = self.equiangular::<M, O>(leaving, &ray, observer);
        let stop = match self.travel(origin, leaving.dir, &ray, leaving.alive.value) {
            Travel::Absorbed => None,
            Travel::Volume(v) => {
                let flight = span.map(|span| v.flight(span, origin, leaving.dir));
                Some(self.at_volume::<M, O>(leaving, &ray, &v, flight, 1.0, observer))
            }
            Travel::Surface(vertex, arrival) => {
                Some(self.at_surface::<M, O>(leaving, &ray, vertex, arrival, observer))
            }
            Travel::Escape(arrival) => {
                self.escape::<M, O>(leaving, &ray, arrival, observer);
                None
            }
        };
        self.ray = Some(ray);
        stop
    }

    /// Arrives at a volume vertex, whose own emission counts by `emission_weight`.
    fn at_volume<M: TransportMode, O: Observer>(
        &mut self,
        leaving: &OutgoingRay,
        ray: &RayPath,
        v: &Flown,
        flight: Option<Flight>,
        emission_weight: f64,
        observer: &mut O,
    ) -> PathState {
        let segments = leaving.segments + 1;
        let throughput = leaving.throughput * v.arrival;
        if M::EMISSION {
            let source = v.coefficients.source() * emission_weight;
            if !source.is_zero() {
                observer.contribution(Pixel::Own, segments, throughput * source);
            }
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
        PathState {
            node,
            vertex: v.vertex,
            coefficients: Some(v.coefficients),
            from: -leaving.dir,
            throughput,
            arrival: v.arrival,
            alive: leaving.alive,
            segments,
            flight,
        }
    }

    /// Arrives at a surface.
    fn at_surface<M: TransportMode, O: Observer>(
        &mut self,
        leaving: &OutgoingRay,
        ray: &RayPath,
        vertex: Vertex,
        arrival: Rgb,
        observer: &mut O,
    ) -> PathState {
        let segments = leaving.segments + 1;
        let throughput = leaving.throughput * arrival;
        let mut emission_weight = 0.0;
        // A black emitter with a moving radiance must be recorded too, so the weight does not
        // depend on the value being nonzero.
        if let Some((emitted, weight)) = leaving.met(self.world, ray).filter(|_| M::EMISSION) {
            emission_weight = weight;
            observer.contribution(Pixel::Own, segments, throughput * emitted * emission_weight);
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
        PathState {
            node,
            vertex,
            coefficients: None,
            from: -leaving.dir,
            throughput,
            arrival,
            alive: leaving.alive,
            segments,
            flight: None,
        }
    }

    /// Leaves the scene.
    fn escape<M: TransportMode, O: Observer>(
        &mut self,
        leaving: &OutgoingRay,
        ray: &RayPath,
        arrival: Rgb,
        observer: &mut O,
    ) {
        let met = leaving.met(self.world, ray).filter(|_| M::EMISSION);
        let unlit = (leaving.node == 0 && observer.keeps_escapes()).then_some((Rgb::ZERO, 0.0));
        let Some((radiance, emission_weight)) = met.or(unlit) else { return };
        let throughput = leaving.throughput * arrival;
        let radiance = radiance * emission_weight;
        observer.contribution(Pixel::Own, leaving.segments + 1, throughput * radiance);
        let record = Arrival {
            parent: leaving.node,
            end: Endpoint::Environment,
            dir: leaving.dir,
            distance: f64::INFINITY,
            start_medium: ray.medium,
            arrival,
            throughput,
            emission_weight,
        };
        observer.arrive(self.world, &record, &ray.crossings);
    }

    /// Connects a volume vertex to a point, the vertex being at a distance chosen by the angle it is seen under
    /// (Kulla and Fajardo 2012): free-flight sampling alone has infinite variance near a point inside a medium
    /// (theory sheet §14.2). Returns the part of the ray it covers.
    fn equiangular<M: TransportMode, O: Observer>(
        &mut self,
        leaving: &OutgoingRay,
        ray: &RayPath,
        observer: &mut O,
    ) -> Option<(f64, f64)> {
        if leaving.segments + 2 > self.max_segments || !M::has_points(self.world) {
            return None;
        }
        let span = medium_span(ray)?;
        let point = M::choose_point(self);
        let (origin, dir) = (leaving.vertex.x, leaving.dir);
        let placed = self.place_towards(origin, dir, ray, span, point.at, point.total);
        // The emission here is left to free flight.
        let stop = placed.map(|v| self.at_volume::<M, O>(leaving, ray, &v, None, 0.0, observer));
        if let Some(stop) = stop {
            M::connect_to_point(self, &stop, &point, observer);
        }
        Some(span)
    }

    /// Adds the light of one sampled emitter point, scattered at `stop`.
    #[inline]
    pub(super) fn connect_light<O: Observer>(
        &mut self,
        stop: &PathState,
        light: &LightSample,
        weight: f64,
        sigma_s: Rgb,
        observer: &mut O,
    ) {
        let world = self.world;
        let Some(scattering) = world.scattering(&stop.vertex) else { return };
        let f = scattering.eval(stop.from, light.w);
        let spare = O::RECORDS && world.may_revive(&stop.vertex);
        if weight == 0.0 || (f.is_zero() && !spare) {
            return;
        }
        let (v, w, d) = (&stop.vertex, light.w, light.distance);
        let target = light.point().map(|s| s.prim);
        let tau = if world.any_straight && light.is_delta() {
            // All other lights are found by paths that go straight through.
            match self.straight_transmittance(v, w, d) {
                Some(tau) => tau,
                None => return,
            }
        } else {
            if !world.connect(v, w, d, target, &mut self.shadow, &mut self.counters) {
                return;
            }
            world.transmittance(&Ray::new(v.x, w), &self.shadow, &mut self.rng, &mut self.counters)
        };
        let transport = tau * (weight * light.inv_pdf * self.connected);
        if transport.is_zero() {
            return;
        }
        let start_medium = self.shadow.medium;
        let connection = Connection { light: *light, start_medium, f, transport };
        let value = stop.throughput * sigma_s * f * connection.rest();
        observer.contribution(Pixel::Own, stop.segments + 1, value);
        observer.connect(stop.node, &connection, &self.shadow.crossings);
    }

    /// The part of the light that arrives at a vertex along a direction from a distance, surfaces that it goes straight
    /// through included; `None` where something blocks.
    #[cold]
    fn straight_transmittance(&mut self, v: &Vertex, w: Vec3, d: f64) -> Option<Rgb> {
        let world = self.world;
        let part = world.connect_straight(v, w, d, &mut self.shadow, &mut self.counters);
        if part.is_zero() {
            return None;
        }
        let tau =
            world.transmittance(&Ray::new(v.x, w), &self.shadow, &mut self.rng, &mut self.counters);
        Some(tau * part)
    }
}

impl OutgoingRay {
    /// What emits at the end of a ray, if anything does: its radiance towards the ray's start, and the weight of that against
    /// next-event estimation.
    pub(crate) fn met(&self, world: &World, ray: &RayPath) -> Option<(Rgb, f64)> {
        let weight = |light: f64| self.pdf.map_or(1.0, |p| p / (p + light));
        if let Some((point, _)) = &ray.end {
            world.emits(point).then(|| {
                let light = world.lights.area_pdf(point, self.dir, ray.length);
                (world.emitted(point, -self.dir), weight(light))
            })
        } else {
            let hidden = self.misses_emitters(world);
            let environment = world.lights.environment().filter(|_| !hidden)?;
            let radiance = environment.radiance(self.dir);
            Some((radiance, weight(environment.pdf(self.dir))))
        }
    }
}

impl Alive {
    pub(super) fn new(value: Rgb) -> Self {
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
