//! Terms whose samples land anywhere on the film: boundary segments and pixel borders.

use alloc::vec::Vec;

use drt_math::sobol::SobolSampler;
use drt_math::{Rgb, Rng};

use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::sensitivity::VelocityFunctional;
use crate::model::rendering::{Account, Counters, NonFinite, Term};
use crate::sampling::film::Splats;
use crate::sampling::guide::{self, Drawn, Guide};
use crate::sampling::streams::{DIMENSIONS, LINE_STREAM, SEQUENCE_STREAM};
use crate::sampling::trace::Tracer;
use crate::terms::boundary_segments;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::flux;
use crate::terms::interior::GrazingPaths;
use crate::terms::light_paths::LightPaths;
use crate::terms::selected::Terms;
use crate::world::World;

/// What splatted terms are sampled from.
pub(crate) struct Splatter<'a> {
    pub(crate) world: &'a World,
    /// Lit by all emitters.
    pub(crate) all: &'a World,
    pub(crate) terms: &'a Terms,
    pub(crate) seed: u64,
    /// True when a batch shall end before it is done, to be thrown away.
    pub(crate) cancelled: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> Splatter<'a> {
    /// This splatter with batches that end early when `cancelled` says so.
    pub(crate) fn until(self, cancelled: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self { cancelled, ..self }
    }
}

impl Splatter<'_> {
    /// Samples `count` times from a source, as its guide says if there is one, and hands everything to `receiver`. The
    /// stream is unique to the batch.
    pub(crate) fn run<R: BoundarySink>(
        &self,
        source: BoundarySource,
        guide: Option<&Guide>,
        stream: u64,
        count: u32,
        receiver: &mut Checked<R>,
    ) -> Account {
        self.run_observed(source, guide, stream, count, receiver, |_, _, _, _| {})
    }

    /// The same, which calls `observe` after each sample of a guide with the receiver, what was drawn, and rays and lookups.
    pub(crate) fn run_observed<R: BoundarySink>(
        &self,
        source: BoundarySource,
        guide: Option<&Guide>,
        stream: u64,
        count: u32,
        receiver: &mut Checked<R>,
        mut observe: impl FnMut(&mut R, &Drawn, u64, u64),
    ) -> Account {
        let of_paths = source.term() == Term::Interior;
        let mut tracer = Tracer::new(if of_paths { self.all } else { self.world });
        let mut edges = boundary_segments::Buffers::default();
        let mut functional = VelocityFunctional::default();
        let mut flux = flux::Buffers::default();
        let emission = self.terms.emission.as_ref().filter(|_| of_paths);
        let mut light_paths =
            emission.map(|emission| LightPaths::new(self.all, emission, self.world, self.terms));
        let grazing = self.terms.grazing.as_ref().filter(|_| of_paths);
        let mut grazing_paths =
            grazing.map(|seen| GrazingPaths::new(self.all, seen, self.world, self.terms));
        receiver.term = Some(source.term());
        receiver.seed = self.seed;
        receiver.stream = stream;
        // One Sobol' sequence a batch, so that the scatter of batches stays an honest error.
        let sequence = Rng::new(self.seed, SEQUENCE_STREAM | stream, 0).next_u32();
        for index in 0..count {
            if (self.cancelled)() {
                break;
            }
            let mut points = SobolSampler::new(sequence, index);
            let rng = Rng::new(self.seed, stream, index);
            let drawn = guide.map(|g| g.draw(core::array::from_fn(|_| points.next_f64())));
            tracer.rng = match &drawn {
                None => rng.led_by(points, DIMENSIONS),
                Some(drawn) => {
                    let others = DIMENSIONS - guide::DIMENSIONS as u32;
                    rng.led_by(points, others).starting_with(drawn.point)
                }
            };
            receiver.weight = drawn.as_ref().map_or(1.0, |drawn| drawn.inverse_density);
            receiver.index = index;
            let [rays, lookups] = [tracer.counters.rays, tracer.counters.tracking_steps];
            match source {
                BoundarySource::Edges(strategy) => {
                    self.terms.boundary.sample(strategy, &mut tracer, &mut edges, receiver);
                }
                BoundarySource::Borders => {
                    boundary_segments::border::sample(&mut tracer, &mut edges, receiver);
                }
                BoundarySource::PrimaryEdges => {
                    if let Some(edges) = &self.terms.edges {
                        edges.primary_edge(&mut tracer, &mut functional, receiver);
                    }
                }
                BoundarySource::GrazingFlux => {
                    if let Some(seen) = &self.terms.grazing_flux {
                        seen.sample(&mut tracer, &mut flux, receiver);
                    }
                }
                BoundarySource::GrazingPaths => {
                    if let Some(paths) = &mut grazing_paths {
                        paths.sample(&mut tracer, [self.seed, stream], index, receiver);
                    }
                }
                BoundarySource::LightPaths => {
                    if let Some(paths) = &mut light_paths {
                        let line = Rng::new(self.seed, LINE_STREAM | stream, index);
                        paths.sample(&mut tracer, &line, receiver);
                    }
                }
            }
            if let Some(drawn) = &drawn {
                let Counters { rays: after, tracking_steps, .. } = tracer.counters;
                observe(&mut receiver.inner, drawn, after - rays, tracking_steps - lookups);
            }
        }
        Account {
            counters: tracer.counters,
            non_finite: core::mem::take(&mut receiver.found),
            non_finite_count: receiver.count,
            query_rays: 0,
        }
    }
}

/// Passes finite values on, weighted as their sample is guided; counts and describes the others.
pub(crate) struct Checked<R> {
    pub(crate) inner: R,
    /// One over the density of a guide. Of what is [spread](BoundarySink::spread) there are none.
    weight: f64,
    term: Option<Term>,
    seed: u64,
    stream: u64,
    index: u32,
    found: Vec<NonFinite>,
    count: u64,
}

impl<R> Checked<R> {
    pub(crate) fn new(inner: R) -> Self {
        Self {
            inner,
            weight: 1.0,
            term: None,
            seed: 0,
            stream: 0,
            index: 0,
            found: Vec::new(),
            count: 0,
        }
    }
}

impl<R: BoundarySink> BoundarySink for Checked<R> {
    fn moves(&mut self, functional: &VelocityFunctional) -> bool {
        self.inner.moves(functional)
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        let value = value * self.weight;
        if value.is_finite() {
            self.inner.receive(pixel, value);
            return;
        }
        self.report();
    }

    type Sink = R::Sink;

    fn spread(&mut self, pixels: &[(u32, f64)], send: impl FnOnce(&mut R::Sink)) -> bool {
        let finite = self.inner.spread(pixels, send);
        if !finite {
            self.report();
        }
        finite
    }
}

impl<R> Checked<R> {
    /// Notes a value that is not finite.
    fn report(&mut self) {
        self.count += 1;
        if self.found.len() < 8 {
            self.found.push(NonFinite {
                term: self.term,
                seed: self.seed,
                stream: self.stream,
                index: self.index,
                bounces: 0,
                primitive: None,
            });
        }
    }
}

/// Forward mode: adds each parameter's derivative to its image.
pub(crate) struct ToImages<'a> {
    contraction: Contraction<'a>,
    pub(crate) splats: Splats,
}

impl<'a> ToImages<'a> {
    pub(crate) fn new(world: &'a World, motion: &'a Motion) -> Self {
        Self {
            contraction: Contraction::new(world, motion),
            splats: Splats::new(world.camera.film(), motion.parameters()),
        }
    }
}

impl<'a> BoundarySink for ToImages<'a> {
    fn moves(&mut self, functional: &VelocityFunctional) -> bool {
        self.contraction.evaluate(functional)
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        for (layer, rate) in self.contraction.rates.iter().enumerate() {
            if rate.r != 0.0 {
                self.splats.add(layer, pixel, value * rate.r);
            }
        }
    }

    type Sink = Contraction<'a>;

    fn spread(&mut self, pixels: &[(u32, f64)], send: impl FnOnce(&mut Contraction<'a>)) -> bool {
        self.contraction.clear();
        send(&mut self.contraction);
        let rates = &self.contraction.rates;
        let finite = rates.iter().all(|rate| rate.is_finite());
        for (layer, rate) in rates.iter().enumerate().filter(|(_, r)| finite && !r.is_zero()) {
            for (pixel, weight) in pixels {
                self.splats.add(layer, *pixel, *rate * *weight);
            }
        }
        finite
    }
}
