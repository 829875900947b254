//! Terms whose samples land anywhere on the film: boundary segments and pixel borders.

use alloc::vec::Vec;

use drt_math::sobol::SobolSampler;
use drt_math::{Rgb, Rng};

use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::sensitivity::Functional;
use crate::model::rendering::{Account, NonFinite, Term};
use crate::sampling::film::Splats;
use crate::sampling::streams::{DIMENSIONS, SEQUENCE_STREAM};
use crate::sampling::trace::Tracer;
use crate::terms::boundary;
use crate::terms::boundary::{Boundary, Receiver, Strategy};
use crate::terms::flux;
use crate::terms::flux::EdgeOn;
use crate::terms::radiative::Radiative;
use crate::world::World;

/// A splatted source of derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// Boundary segments found by a strategy.
    Edges(Strategy),
    /// Jumps of a box filter.
    Borders,
    /// Edges seen from the camera, in the spatial form.
    Outlines,
    /// The flux through what the camera sees edge on.
    EdgeOn,
}

impl Source {
    pub(crate) fn term(self) -> Term {
        match self {
            Self::Edges(Strategy::Primary) | Self::Borders | Self::Outlines => Term::Primary,
            Self::Edges(Strategy::Direct) => Term::Direct,
            Self::Edges(Strategy::Indirect) => Term::Indirect,
            Self::EdgeOn => Term::Flux,
        }
    }

    /// Tells the source's random numbers apart from all others.
    pub(crate) fn stream(self) -> u64 {
        let id = match self {
            Self::Edges(Strategy::Primary) => 1,
            Self::Edges(Strategy::Direct) => 2,
            Self::Edges(Strategy::Indirect) => 3,
            Self::Borders => 4,
            Self::Outlines => 5,
            Self::EdgeOn => 6,
        };
        id << 40
    }

    /// Samples of it to one of other sources.
    pub(crate) fn part(self) -> f64 {
        if self == Self::EdgeOn { 0.0625 } else { 1.0 }
    }

    /// True for the edges that the camera sees.
    pub(crate) fn is_of_camera(self) -> bool {
        matches!(self, Self::Outlines | Self::Edges(Strategy::Primary))
    }

    /// True when no sample counts much more than others.
    pub(crate) fn is_even(self) -> bool {
        matches!(self, Self::Outlines | Self::EdgeOn)
    }
}

/// What splatted terms are sampled from.
pub(crate) struct Splatter<'a> {
    pub(crate) world: &'a World,
    pub(crate) boundary: &'a Boundary,
    pub(crate) radiative: Option<&'a Radiative>,
    pub(crate) edge_on: Option<&'a EdgeOn>,
    pub(crate) seed: u64,
}

impl Splatter<'_> {
    /// Samples `count` times from a source and hands everything to `receiver`. The stream is unique
    /// to the batch.
    pub(crate) fn run<R: Receiver>(
        &self,
        source: Source,
        stream: u64,
        count: u32,
        receiver: &mut Checked<R>,
    ) -> Account {
        let mut tracer = Tracer::new(self.world);
        let mut edges = boundary::Buffers::default();
        let mut functional = Functional::default();
        let mut edge_on = flux::Buffers::default();
        receiver.term = Some(source.term());
        receiver.seed = self.seed;
        receiver.stream = stream;
        // One Sobol' sequence a batch, so that the scatter of batches stays an honest error.
        let sequence = Rng::new(self.seed, SEQUENCE_STREAM | stream, 0).next_u32();
        for index in 0..count {
            let points = SobolSampler::new(sequence, index);
            tracer.rng = Rng::new(self.seed, stream, index).led_by(points, DIMENSIONS);
            receiver.index = index;
            match source {
                Source::Edges(strategy) => {
                    self.boundary.sample(strategy, &mut tracer, &mut edges, receiver);
                }
                Source::Borders => {
                    boundary::border::sample(&mut tracer, &mut edges, receiver);
                }
                Source::Outlines => {
                    if let Some(radiative) = self.radiative {
                        radiative.outline(&mut tracer, &mut functional, receiver);
                    }
                }
                Source::EdgeOn => {
                    if let Some(seen) = self.edge_on {
                        seen.sample(&mut tracer, &mut edge_on, receiver);
                    }
                }
            }
        }
        Account {
            counters: tracer.counters,
            non_finite: core::mem::take(&mut receiver.found),
            non_finite_count: receiver.count,
            looking: 0,
        }
    }
}

/// Passes finite values on; counts and describes the others.
pub(crate) struct Checked<R> {
    pub(crate) inner: R,
    term: Option<Term>,
    seed: u64,
    stream: u64,
    index: u32,
    found: Vec<NonFinite>,
    count: u64,
}

impl<R> Checked<R> {
    pub(crate) fn new(inner: R) -> Self {
        Self { inner, term: None, seed: 0, stream: 0, index: 0, found: Vec::new(), count: 0 }
    }
}

impl<R: Receiver> Receiver for Checked<R> {
    fn moves(&mut self, functional: &Functional) -> bool {
        self.inner.moves(functional)
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        if value.is_finite() {
            self.inner.receive(pixel, value);
            return;
        }
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

impl Receiver for ToImages<'_> {
    fn moves(&mut self, functional: &Functional) -> bool {
        self.contraction.evaluate(functional)
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        for (layer, rate) in self.contraction.rates.iter().enumerate() {
            if rate.r != 0.0 {
                self.splats.add(layer, pixel, value * rate.r);
            }
        }
    }
}
