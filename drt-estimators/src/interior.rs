//! The interior term, and the plain forward image: one pixel sample at a time.

use alloc::vec::Vec;

use drt_math::{Rgb, Rng};

use crate::contraction::{Contraction, Motion};
use crate::flux::{self, Flux};
use crate::rendering::{Counters, NonFinite, Term};
use crate::sensitivity::AdjointSink;
use crate::transport::{Differentiator, PathRecord, Radiance, Tracer, World};

/// Random-number streams are pixels; the top bits tell other uses apart.
pub(crate) const LINE_STREAM: u64 = 1 << 62;

/// Samples pixels and differentiates what it traces.
pub(crate) struct PixelSampler<'a> {
    world: &'a World,
    seed: u64,
    antithetic: bool,
    tracer: Tracer<'a>,
    record: PathRecord,
    differentiator: Differentiator<'a>,
    contraction: Option<Contraction<'a>>,
    flux: Option<&'a Flux>,
    buffers: flux::Buffers,
    separate: bool,
    pub(crate) non_finite: Vec<NonFinite>,
    pub(crate) non_finite_count: u64,
    differentiated: u64,
    recorded: u64,
}

/// Non-finite samples that are described one by one.
const DESCRIBED: usize = 8;

impl<'a> PixelSampler<'a> {
    pub(crate) fn new(
        world: &'a World,
        motion: Option<&'a Motion>,
        flux: Option<&'a Flux>,
        seed: u64,
        antithetic: bool,
        separate: bool,
    ) -> Self {
        Self {
            world,
            seed,
            antithetic,
            tracer: Tracer::new(world),
            record: PathRecord::default(),
            differentiator: Differentiator::new(world),
            contraction: motion.map(|m| Contraction::new(world, m)),
            flux,
            buffers: flux::Buffers::default(),
            separate,
            non_finite: Vec::new(),
            non_finite_count: 0,
            differentiated: 0,
            recorded: 0,
        }
    }

    /// Layers of a sample: the image, a derivative per parameter, and where flux is kept apart that
    /// of each parameter.
    pub(crate) fn layers(parameters: usize, separate_flux: bool) -> usize {
        1 + parameters * if separate_flux { 2 } else { 1 }
    }

    /// Work done so far.
    pub(crate) fn counters(&self) -> Counters {
        Counters {
            differentiated_paths: self.differentiated,
            recorded_vertices: self.recorded,
            ..self.tracer.counters
        }
    }

    /// Sample `unit` of a pixel: a path, or a pair of paths mirrored at the pixel's centre.
    pub(crate) fn sample(&mut self, pixel: u32, unit: u32, values: &mut [Rgb]) {
        values.fill(Rgb::ZERO);
        let mut rng = Rng::new(self.seed, u64::from(pixel), unit);
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

    fn path(&mut self, pixel: u32, unit: u32, u: [f64; 2], rng: Rng, values: &mut [Rgb]) {
        let camera = &self.world.camera;
        let derivative = self.contraction.is_some();
        let s = camera.sample_view(pixel, u, derivative);
        let dir = s.direction;
        let weight = Rgb::splat(s.weight);
        self.tracer.rng = rng;
        let Some(contraction) = &mut self.contraction else {
            let mut radiance = Radiance::default();
            self.tracer.from_camera(dir, weight, &mut radiance);
            values[0] += radiance.0;
            return;
        };
        self.record.begin(dir, weight);
        self.tracer.from_camera(dir, weight, &mut self.record);
        values[0] += self.record.value;
        self.recorded += self.record.nodes.len() as u64;
        let n = contraction.rates.len();
        if contraction.interest().any() {
            self.differentiated += 1;
            let line = Rng::new(self.seed, LINE_STREAM | u64::from(pixel), unit);
            contraction.clear();
            self.differentiator.differentiate(&self.record, s.slope, line, contraction);
            for (v, r) in values[1..=n].iter_mut().zip(&contraction.rates) {
                *v += *r;
            }
        }
        if let Some(flux) = self.flux {
            let at = if self.separate { 1 + n } else { 1 };
            let (tracer, buffers) = (&mut self.tracer, &mut self.buffers);
            flux.along_camera_ray(tracer, dir, buffers, |functional, value| {
                if contraction.evaluate(functional) {
                    for (v, r) in values[at..at + n].iter_mut().zip(&contraction.rates) {
                        *v += value * weight * r.r;
                    }
                }
            });
        }
    }

    /// Notes a sample that is not finite and counts it as zero.
    fn report(&mut self, pixel: u32, unit: u32, values: &mut [Rgb]) {
        self.non_finite_count += 1;
        if self.non_finite.len() < DESCRIBED {
            let last = self.record.nodes.last().and_then(|n| n.vertex()?.surface().map(|s| s.prim));
            self.non_finite.push(NonFinite {
                term: values[0].is_finite().then_some(Term::Interior),
                seed: self.seed,
                stream: u64::from(pixel),
                index: unit,
                bounces: self.record.nodes.len() as u32,
                primitive: last,
            });
        }
        for v in values.iter_mut().filter(|v| !v.is_finite()) {
            *v = Rgb::ZERO;
        }
    }
}
