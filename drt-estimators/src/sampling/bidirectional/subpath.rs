//! Paths from one end.

use alloc::vec::Vec;
use core::marker::PhantomData;
use core::ops::Range;

use drt_math::{Rgb, Rng, Vec3};
use drt_medium::Coefficients;

use crate::model::surface::Given;
use crate::sampling::flight::proxy_attenuation;
use crate::sampling::record::{JointObserver, Scattered};
use crate::sampling::trace::{Arrival, Endpoint, Observer, OutgoingRay, PathState, Pixel, Tracer};
use crate::sampling::transport_mode::{ConnectionPoint, TransportMode};
use crate::world::scatter::Scattering;
use crate::world::vertex::{Kind, Vertex};
use crate::world::{Crossing, RayPath, World};

/// A transport mode whose walks connect to nothing on their way.
pub(super) struct Unconnected<M>(PhantomData<M>);

impl<M: TransportMode> TransportMode for Unconnected<M> {
    const GIVEN: Given = M::GIVEN;
    const EMISSION: bool = M::EMISSION;

    fn value(scattering: &Scattering<'_>, from: Vec3, to: Vec3) -> Rgb {
        M::value(scattering, from, to)
    }

    fn connect<O: Observer>(
        _: &mut Tracer<'_>,
        _: &PathState,
        _: &Scattering<'_>,
        _: Rgb,
        _: &mut O,
    ) {
    }

    fn has_points(_: &World) -> bool {
        false
    }

    fn choose_point(tracer: &mut Tracer<'_>) -> ConnectionPoint {
        M::choose_point(tracer)
    }

    fn connect_to_point<O: Observer>(
        _: &mut Tracer<'_>,
        _: &PathState,
        _: &ConnectionPoint,
        _: &mut O,
    ) {
    }
}

/// The sums over strategies of the module's table, before a ray or at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ratios {
    /// d.
    pub(super) last: f64,
    /// e.
    pub(super) earlier: f64,
}

impl Ratios {
    /// e p'² + d, all that is weighed by the density of the vertex itself.
    pub(super) fn all(&self, back: f64) -> f64 {
        self.earlier * square(back) + self.last
    }

    /// Leaving a vertex with a `cosine` there, the density of the direction and of the one `back`.
    fn scatter(&self, cosine: f64, pdf: f64, back: f64) -> Self {
        Self { last: 1.0 / square(pdf), earlier: square(cosine / pdf) * self.all(back) }
    }

    /// Leaving in the only direction of a smooth surface, to which nothing can be connected. Its probability is that of the way back.
    fn reflect(&self, cosine: f64) -> Self {
        Self { last: 0.0, earlier: self.earlier * square(cosine) }
    }

    /// Arriving, `spread` being the squared distance, or 1 of what comes from infinity.
    fn arrive(&self, spread: f64, cosine: f64, attenuation: f64) -> Self {
        Self {
            last: self.last * square(spread / (cosine * attenuation)),
            earlier: self.earlier / square(cosine),
        }
    }
}

pub(super) fn square(x: f64) -> f64 {
    x * x
}

/// A vertex of a path from one end.
#[derive(Clone, Copy, Debug)]
pub(super) struct SubpathVertex {
    pub(super) vertex: Vertex,
    pub(super) coefficients: Option<Coefficients>,
    /// Unit, to where the path comes from.
    pub(super) from: Vec3,
    /// All before the vertex scatters.
    pub(super) throughput: Rgb,
    pub(super) ratios: Ratios,
    /// Segments from the path's start.
    pub(super) segments: u32,
}

impl SubpathVertex {
    /// The scattering coefficient of a volume; 1 on a surface.
    pub(super) fn sigma_s(&self) -> Rgb {
        self.coefficients.as_ref().map_or(Rgb::ONE, Coefficients::sigma_s)
    }

    /// The throughput, with the scattering coefficient of a volume.
    pub(super) fn weight(&self) -> Rgb {
        self.throughput * self.sigma_s()
    }

    /// As the end of a segment.
    pub(super) fn end(&self) -> Endpoint {
        match self.coefficients {
            Some(c) => Endpoint::Volume(self.vertex, c),
            None => Endpoint::Surface(self.vertex),
        }
    }

    /// How a vertex of a light path scatters to the unit direction `wo`, over a density.
    pub(super) fn scattered(&self, own: &Scattering<'_>, wo: Vec3, inv_pdf: f64) -> Scattered {
        let inv_pdf = inv_pdf * own.adjoint_correction(wo, self.from);
        Scattered { value: own.eval(wo, self.from), inv_pdf }
    }

    /// |n·w| of the geometric normal; 1 in a volume.
    pub(super) fn cosine(&self, w: Vec3) -> f64 {
        cosine(&self.vertex, w)
    }
}

fn cosine(vertex: &Vertex, w: Vec3) -> f64 {
    match &vertex.kind {
        Kind::Surface(s) => s.ng.dot(w).abs(),
        _ => 1.0,
    }
}

/// The segment by which a walk arrived at a vertex, and how it went on.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Transmittance over the density of the distance.
    pub(super) arrival: Rgb,
    pub(super) distance: f64,
    pub(super) start_medium: Option<usize>,
    pub(super) crossings: Range<usize>,
    /// 1 over the density of the direction in which the walk left, Russian roulette included.
    pub(super) inv_pdf: f64,
}

/// A path from one end, as a walk tells it.
#[derive(Debug)]
pub(super) struct Subpath {
    pub(super) vertices: Vec<SubpathVertex>,
    /// By vertex, where paths are recorded.
    pub(super) arrivals: Vec<Segment>,
    pub(super) crossings: Vec<Crossing>,
    /// The directions that walks of its mode are given.
    given: Given,
    /// Of the ray about to be followed.
    ratios: Ratios,
    /// Segments with it.
    segments: u32,
    finite: bool,
    /// Light that came in from outside, or from inside of a medium.
    pub(super) met: Rgb,
}

impl Subpath {
    pub(super) fn new(given: Given) -> Self {
        Self {
            vertices: Vec::new(),
            arrivals: Vec::new(),
            crossings: Vec::new(),
            given,
            ratios: Ratios::default(),
            segments: 1,
            finite: true,
            met: Rgb::ZERO,
        }
    }

    /// Forgets the last path. Where the next one starts is at a point of the scene, or at infinity.
    pub(super) fn begin(&mut self, ratios: Ratios, finite: bool) {
        self.vertices.clear();
        self.arrivals.clear();
        self.crossings.clear();
        (self.ratios, self.segments) = (ratios, 1);
        (self.finite, self.met) = (finite, Rgb::ZERO);
    }

    /// The density of the direction back, from one that the other end's walk would come from.
    pub(super) fn back(&self, scattering: &Scattering<'_>, to: Vec3, from: Vec3) -> f64 {
        let given = match self.given {
            Given::Wo => Given::Wi,
            Given::Wi => Given::Wo,
        };
        scattering.pdf(to, from, given)
    }
}

/// Makes a [`Subpath`] of a walk that something else observes as well.
pub(super) struct Observed<'a, O> {
    pub(super) subpath: &'a mut Subpath,
    pub(super) observer: &'a mut O,
}

/// Observes nothing, of paths that are recorded if `O` records.
pub(super) struct Unobserved<O>(pub(super) PhantomData<O>);

impl<O: Observer> Observer for Unobserved<O> {
    const RECORDS: bool = O::RECORDS;

    fn contribution(&mut self, _: Pixel, _: u32, _: Rgb) {}
}

impl<O: Observer> JointObserver for Unobserved<O> {}

impl<O: JointObserver> Observer for Observed<'_, O> {
    const RECORDS: bool = O::RECORDS;

    // Emission is weighed by who knows all strategies.
    fn contribution(&mut self, _: Pixel, _: u32, _: Rgb) {}

    fn ray(&mut self, world: &World, leaving: &OutgoingRay, ray: &RayPath) {
        self.observer.ray(world, leaving, ray);
    }

    fn arrive(&mut self, world: &World, arrival: &Arrival, crossings: &[Crossing]) -> u32 {
        let emission = self.subpath.arrive(world, arrival, crossings);
        if O::RECORDS {
            self.subpath.keep(arrival, crossings);
        }
        let node = self.observer.arrive(world, arrival, crossings);
        if let Some(weight) = emission {
            self.observer.emission(node, weight);
        }
        node
    }

    fn scatter(
        &mut self,
        world: &World,
        leaving: &OutgoingRay,
        value: Rgb,
        inv_pdf: f64,
        rng: &Rng,
    ) {
        self.subpath.scatter(world, leaving, inv_pdf);
        self.observer.scatter(world, leaving, value, inv_pdf, rng);
    }
}

impl Subpath {
    /// Returns the MIS weight of what comes from the environment, where the walk escapes to it.
    fn arrive(&mut self, world: &World, arrival: &Arrival, crossings: &[Crossing]) -> Option<f64> {
        let (vertex, coefficients) = match &arrival.end {
            Endpoint::Environment => {
                let environment = world.lights.environment()?;
                let dir = arrival.dir;
                // Of light samples, which the camera itself has none of.
                let others = if self.vertices.is_empty() {
                    0.0
                } else {
                    let medium = arrival.start_medium;
                    let passed = proxy_attenuation(world, medium, crossings, f64::INFINITY);
                    square(environment.pdf(dir) / passed) * self.ratios.last
                };
                let weight = if others > 0.0 { 1.0 / (1.0 + others) } else { 1.0 };
                self.met += arrival.throughput * environment.radiance(dir) * weight;
                return Some(weight);
            }
            Endpoint::Surface(v) => (*v, None),
            Endpoint::Volume(v, c) => {
                self.met += arrival.throughput * c.source();
                (*v, Some(*c))
            }
        };
        let spread = if self.finite { square(arrival.distance) } else { 1.0 };
        let medium = arrival.start_medium;
        let attenuation = proxy_attenuation(world, medium, crossings, arrival.distance);
        let ratios = self.ratios.arrive(spread, cosine(&vertex, arrival.dir), attenuation);
        self.vertices.push(SubpathVertex {
            vertex,
            coefficients,
            from: -arrival.dir,
            throughput: arrival.throughput,
            ratios,
            segments: self.segments,
        });
        self.finite = true;
        None
    }

    fn keep(&mut self, arrival: &Arrival, crossings: &[Crossing]) {
        let first = self.crossings.len();
        self.crossings.extend_from_slice(crossings);
        self.arrivals.push(Segment {
            arrival: arrival.arrival,
            distance: arrival.distance,
            start_medium: arrival.start_medium,
            crossings: first..self.crossings.len(),
            inv_pdf: 0.0,
        });
    }

    fn scatter(&mut self, world: &World, leaving: &OutgoingRay, inv_pdf: f64) {
        if let Some(arrival) = self.arrivals.last_mut() {
            arrival.inv_pdf = inv_pdf;
        }
        let Some(v) = self.vertices.last() else { return };
        let Some(scattering) = world.scattering(&v.vertex) else { return };
        let cosine = v.cosine(leaving.dir);
        self.segments = leaving.segments + 1;
        self.ratios = match leaving.pdf() {
            Some(pdf) => v.ratios.scatter(cosine, pdf, self.back(&scattering, leaving.dir, v.from)),
            None => v.ratios.reflect(cosine),
        };
    }
}
