//! The interior term, and the plain forward image: one pixel sample at a time.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::sobol::{SET_DIMENSIONS, SobolSampler};
use drt_math::{Rgb, RgbVec, Rng};

use crate::boundary::shadow::{self, Shadows};
use crate::contraction::Contraction;
use crate::flux::{Flux, Reservoir};
use crate::pixels::Sampler;
use crate::radiative::{Edged, Look, Radiative};
use crate::rendering::{Account, Counters, NonFinite, Term};
use crate::sensitivity::{AdjointSink, Functional, Rate, SurfaceAdjoint};
use crate::transport::pairs::{Brought, Pairs};
use crate::transport::trace::{Arrival, Connection, Leaving, Observer, Pixel};
use crate::transport::velocity::{Material, Movers, Spatial, VelocityField};
use crate::transport::world::Crossing;
use crate::transport::{Differentiator, Radiance, RayPath, RecordedPath, Tracer, World};

/// Random-number streams are pixels; the top bits tell other uses apart.
pub(crate) const LINE_STREAM: u64 = 1 << 62;
const FLUX_STREAM: u64 = 1 << 61;
pub(crate) const SEQUENCE_STREAM: u64 = 1 << 60;
const PAIR_STREAM: u64 = 1 << 59;
/// Numbers of a sample that are spread evenly: image point, and the first vertices.
pub(crate) const DIMENSIONS: u32 = SET_DIMENSIONS;

/// Boundary and flux terms that are found along camera rays.
#[derive(Clone, Copy, Default)]
pub(crate) struct AlongRays<'a> {
    pub(crate) flux: Option<&'a Flux>,
    pub(crate) shadows: Option<&'a Shadows>,
    /// Set in the spatial form.
    pub(crate) radiative: Option<&'a Radiative>,
    pub(crate) looks: Looks,
    /// Pairs of rays tell how narrow lobes turn.
    pub(crate) opposites: bool,
}

/// How often a path looks for edges.
#[derive(Clone, Copy)]
pub(crate) enum Looks {
    /// So many times on average, each time from one of its vertices.
    Average(f64),
    /// Once from each of its vertices.
    EveryVertex,
}

impl Default for Looks {
    fn default() -> Self {
        Self::Average(0.0)
    }
}

impl Looks {
    fn any(self) -> bool {
        !matches!(self, Self::Average(0.0))
    }
}

impl AlongRays<'_> {
    /// The terms kept in layers of their own, where terms are kept apart.
    pub(crate) fn terms(&self) -> impl Iterator<Item = Term> {
        let flux = self.flux.map(|_| Term::Flux);
        let edges = if self.looks.any() { &[Term::Direct, Term::Indirect][..] } else { &[] };
        flux.into_iter().chain(self.shadows.map(|_| Term::Direct)).chain(edges.iter().copied())
    }

    /// Of so many `layers`, where terms and these are kept apart, the first one of looks; and how many each path
    /// takes. Looks from every vertex belong to their path, and have none.
    pub(crate) fn first_of_looks(&self, parameters: usize, layers: usize) -> (usize, f64) {
        match self.looks {
            Looks::Average(looks) if looks > 0.0 => (layers - 2 * parameters, looks),
            _ => (layers, 1.0),
        }
    }

    /// Layers of a sample: the image, a derivative per parameter, and where terms are kept apart
    /// those of each parameter.
    pub(crate) fn layers(&self, parameters: usize, separate: bool) -> usize {
        1 + parameters * (1 + if separate { self.terms().count() } else { 0 })
    }
}

/// The name of a Sobol' sequence of a pixel.
pub(crate) fn sequence_name(seed: u64, pixel: u32, number: u32) -> u32 {
    Rng::new(seed, SEQUENCE_STREAM | u64::from(pixel), number).next_u32()
}

/// Where the derivatives of a pixel's paths go.
pub(crate) trait PathSink: AdjointSink {
    /// A path's sensitivities follow.
    fn begin(&mut self);
    /// They are complete; layers of `values` may be added to.
    fn finish(&mut self, values: &mut [Rgb]);
    /// A boundary or flux contribution found along the camera ray.
    fn functional(&mut self, f: &Functional, value: Rgb, values: &mut [Rgb]);
    /// Layers that each separately kept term takes.
    fn layers(&self) -> usize;
}

impl PathSink for Contraction<'_> {
    fn begin(&mut self) {
        self.clear();
    }
    fn finish(&mut self, values: &mut [Rgb]) {
        for (v, r) in values.iter_mut().zip(&self.rates) {
            *v += *r;
        }
    }
    fn functional(&mut self, f: &Functional, value: Rgb, values: &mut [Rgb]) {
        if self.evaluate(f) {
            for (v, r) in values.iter_mut().zip(&self.rates) {
                *v += value * r.r;
            }
        }
    }
    fn layers(&self) -> usize {
        self.rates.len()
    }
}

impl<S: PathSink> Sampler for PixelSampler<'_, S> {
    /// A path, or a pair of paths mirrored at the pixel's centre.
    fn sample(&mut self, pixel: u32, unit: u32, points: SobolSampler, values: &mut [Rgb]) {
        values.fill(Rgb::ZERO);
        let mut rng = Rng::new(self.seed, u64::from(pixel), unit).led_by(points, DIMENSIONS);
        let u = rng.next_2d();
        if self.antithetic {
            self.path(pixel, unit, u, rng.clone(), values);
            self.path(pixel, unit, u.map(|u| 1.0 - u), rng, values);
            for v in values.iter_mut() {
                *v *= 0.5;
            }
        } else {
            self.path(pixel, unit, u, rng, values);
        }
        if values.iter().any(|v| !v.is_finite()) {
            self.report(pixel, unit, values);
        }
    }
}

/// Samples pixels and differentiates what it traces.
pub(crate) struct PixelSampler<'a, S> {
    world: &'a World,
    seed: u64,
    antithetic: bool,
    tracer: Tracer<'a>,
    path: RecordedPath,
    /// Where it met surfaces with a flux, if there are such.
    flux: Option<Reservoir>,
    camera_ray: RayPath,
    differentiator: Differentiator<'a>,
    pub(crate) sink: Option<S>,
    along: AlongRays<'a>,
    shadow_buffers: shadow::Buffers,
    brought: Brought,
    separate: bool,
    non_finite: Vec<NonFinite>,
    non_finite_count: u64,
    differentiated: u64,
    recorded: u64,
    looking: u64,
}

/// Listens to the walk of a path whose derivative is wanted.
struct Recorder<'r> {
    path: &'r mut RecordedPath,
    flux: Option<&'r mut Reservoir>,
    /// Keeps the camera's ray, where that is asked for.
    camera_ray: Option<&'r mut RayPath>,
}

impl Observer for Recorder<'_> {
    const RECORDS: bool = true;

    fn contribution(&mut self, to: Pixel, segments: u32, value: Rgb) {
        self.path.contribution(to, segments, value);
    }

    fn ray(&mut self, world: &World, leaving: &Leaving, ray: &RayPath) {
        if let (0, Some(kept)) = (leaving.node, &mut self.camera_ray) {
            kept.clone_from(ray);
        }
        if let Some(flux) = &mut self.flux {
            flux.offer(world, leaving, self.path.velocities.moves(leaving.node as usize), ray);
        }
    }

    fn arrive(&mut self, world: &World, arrival: &Arrival, crossings: &[Crossing]) -> u32 {
        let hits = self.flux.as_ref().map_or(&[][..], |flux| flux.hits());
        self.path.arrive(world, arrival, crossings, hits)
    }

    fn scatter(&mut self, world: &World, leaving: &Leaving, value: Rgb, inv_pdf: f64, rng: &Rng) {
        self.path.scatter(world, leaving, value, inv_pdf, rng);
    }

    fn connect(&mut self, node: u32, connection: &Connection, crossings: &[Crossing]) {
        self.path.connect(node, connection, crossings);
    }
}

/// Non-finite samples that are described one by one.
const DESCRIBED: usize = 8;

impl<'a, S: PathSink> PixelSampler<'a, S> {
    pub(crate) fn new(
        world: &'a World,
        sink: Option<S>,
        along: AlongRays<'a>,
        seed: u64,
        antithetic: bool,
        separate: bool,
    ) -> Self {
        let movers = sink.as_ref().map_or_else(Movers::default, |s| Movers::new(s.interest()));
        let field: Arc<dyn VelocityField> = match along.radiative {
            Some(_) => Arc::new(Spatial::new(movers)),
            None => Arc::new(Material::new(movers)),
        };
        Self {
            world,
            seed,
            antithetic,
            tracer: Tracer::new(world),
            path: RecordedPath::new(field, Pairs::new(along.opposites)),
            flux: along.flux.map(Reservoir::new),
            camera_ray: RayPath::default(),
            differentiator: Differentiator::new(world),
            sink,
            along,
            shadow_buffers: shadow::Buffers::default(),
            brought: Brought::default(),
            separate,
            non_finite: Vec::new(),
            non_finite_count: 0,
            differentiated: 0,
            recorded: 0,
            looking: 0,
        }
    }

    /// What the work done so far leaves besides its values.
    pub(crate) fn account(self) -> Account {
        Account {
            counters: Counters {
                differentiated_paths: self.differentiated,
                recorded_vertices: self.recorded,
                ..self.tracer.counters
            },
            non_finite: self.non_finite,
            non_finite_count: self.non_finite_count,
            looking: self.looking,
        }
    }

    fn path(&mut self, pixel: u32, unit: u32, u: [f64; 2], rng: Rng, values: &mut [Rgb]) {
        let camera = &self.world.camera;
        // Only where things move is the filter differentiated.
        let derivative = self.along.radiative.is_none()
            && self.sink.as_ref().is_some_and(|s| s.interest().moves_geometry());
        let s = camera.sample_view(pixel, u, derivative);
        let dir = s.direction;
        let weight = Rgb::splat(s.weight);
        // What places an edge comes before what the path takes an unknown number of.
        let mut rng = rng;
        let look = self.along.looks.any().then(|| Look::reserve(&mut rng));
        self.tracer.rng = rng;
        let Some(sink) = &mut self.sink else {
            let mut radiance = Radiance::default();
            self.tracer.trace_camera(dir, weight, &mut radiance);
            values[0] += radiance.0;
            return;
        };
        let width = camera.film()[0];
        self.path.begin([pixel % width, pixel / width], dir, weight);
        if let Some(flux) = &mut self.flux {
            flux.begin(Rng::new(self.seed, FLUX_STREAM | u64::from(pixel), unit));
        }
        self.path.pairs.begin(Some(Rng::new(self.seed, PAIR_STREAM | u64::from(pixel), unit)));
        let camera_ray = self.along.shadows.map(|_| &mut self.camera_ray);
        let mut recorder = Recorder { path: &mut self.path, flux: self.flux.as_mut(), camera_ray };
        self.tracer.trace_camera(dir, weight, &mut recorder);
        let record = &self.path.record;
        values[0] += record.value;
        self.recorded += record.nodes.len() as u64;
        let n = sink.layers();
        if sink.interest().any() {
            self.differentiated += 1;
            let line = Rng::new(self.seed, LINE_STREAM | u64::from(pixel), unit);
            sink.begin();
            self.differentiator.differentiate(&self.path, s.slope, line, sink);
            let buffer = &mut self.brought;
            self.path.pairs.follow(&mut self.tracer, buffer, |pair, chance, other| {
                self.differentiator.pair(&self.path, pair, chance, other, sink);
            });
            sink.finish(&mut values[1..=n]);
        }
        // Each kept apart goes to layers of its own, in the order of `AlongRays::terms`.
        let mut at = 1;
        if let Some(flux) = &mut self.flux {
            at += if self.separate { n } else { 0 };
            flux.evaluate(&mut self.tracer, |f, swept, value| {
                let values = &mut values[at..at + n];
                let Some(swept) = swept else { return sink.functional(f, value, values) };
                sink.begin();
                f.send(value, sink);
                let [origin, turn] = [swept.origin, swept.turn].map(|v| value.outer(v));
                let at = SurfaceAdjoint::of_place(origin);
                self.differentiator.send_back(&self.path, swept.node, at, RgbVec::ZERO, turn, sink);
                sink.finish(values);
            });
        }
        if let (Some(radiative), Some(look)) = (self.along.radiative, look) {
            let from = if self.separate { at + n } else { at };
            let before = self.tracer.counters.rays;
            self.edges(radiative, look, &mut values[from..]);
            self.looking += self.tracer.counters.rays - before;
        }
        if let (Some(shadows), Some(sink)) = (self.along.shadows, &mut self.sink) {
            at += if self.separate { n } else { 0 };
            shadows.along_camera_ray(
                &mut self.tracer,
                dir,
                &self.camera_ray,
                &mut self.shadow_buffers,
                |f, value| {
                    sink.functional(f, value * weight, &mut values[at..at + n]);
                },
            );
        }
    }

    /// Looks for edges; the `first` look has the best numbers.
    fn edges(&mut self, radiative: &Radiative, mut first: Rng, values: &mut [Rgb]) {
        match self.along.looks {
            Looks::Average(looks) => {
                let mut left = looks;
                while left > 0.0 {
                    // A part of a look is one now and then.
                    let rng = &mut self.tracer.rng;
                    let taken = left >= 1.0 || rng.next_f64() < left;
                    let numbers = if left == looks { &mut first } else { rng };
                    left -= 1.0;
                    let look = taken.then(|| Look::new(numbers));
                    let edge =
                        look.and_then(|look| radiative.edge(&mut self.tracer, &self.path, &look));
                    self.send(edge, 1.0 / looks, values);
                }
            }
            Looks::EveryVertex => {
                for node in 1..self.path.record.nodes.len() {
                    let rng = &mut self.tracer.rng;
                    let look = Look::new(if node == 1 { &mut first } else { rng });
                    let edge = radiative.edge_from(&mut self.tracer, &self.path, node, &look);
                    self.send(edge, 1.0, values);
                }
            }
        }
    }

    /// Contracts a `share` of what an edge contributes; `values` are of the edges' terms.
    fn send(&mut self, edge: Option<Edged>, share: f64, values: &mut [Rgb]) {
        let (Some(sink), Some(e)) = (&mut self.sink, edge) else { return };
        let n = sink.layers();
        let layer = if self.separate && e.node > 1 { n } else { 0 };
        sink.begin();
        for (matter, value) in e.matter.iter().flatten() {
            if sink.interest().moves(matter) {
                Rate::of(*matter, e.n).send(*value * share, sink);
            }
        }
        let viewer = (e.viewer * share).outer(e.n);
        let at = SurfaceAdjoint::of_place(viewer);
        let none = RgbVec::ZERO;
        self.differentiator.send_back(&self.path, e.node, at, none, none, sink);
        sink.finish(&mut values[layer..layer + n]);
    }

    /// Notes a sample that is not finite and counts it as zero.
    fn report(&mut self, pixel: u32, unit: u32, values: &mut [Rgb]) {
        self.non_finite_count += 1;
        if self.non_finite.len() < DESCRIBED {
            let nodes = &self.path.record.nodes;
            let last = nodes.last().and_then(|n| n.vertex()?.surface().map(|s| s.prim));
            self.non_finite.push(NonFinite {
                term: values[0].is_finite().then_some(Term::Interior),
                seed: self.seed,
                stream: u64::from(pixel),
                index: unit,
                bounces: nodes.len() as u32,
                primitive: last,
            });
        }
        for v in values.iter_mut().filter(|v| !v.is_finite()) {
            *v = Rgb::ZERO;
        }
    }
}
