//! Guides of boundary samples, and the pilots from which these are learnt.
//!
//! Each source of boundary samples has a [guide](crate::sampling::guide) of its own, over the first numbers of a sample: what
//! is learnt of shadows says nothing of silhouettes. f² is the sum over pixels and derivatives of what a sample adds to them, squared, each derivative in units of
//! its mean size, so that all count alike; costs are rays and lookups in grids. A pilot goes in rounds, each
//! of which is guided by those before it, and doubles what is known: most samples of a first, even round find nothing.
//!
//! Guided samples find more, and cost more for it. There are fewer of them, so that a source takes the time that it would
//! take without a guide: with the gain g of work, variance is 1/g as large.
//!
//! Pilots take a [part](PART) of the samples of a run at most, and stop where there is nothing to gain. Their samples have no part in
//! derivatives, so these are unbiased whatever was learnt. A pass after others goes on learning, by all samples of the run
//! so far. Pilots draw numbers of their own in batches of fixed size, merged in order: guides are the same for any number of threads,
//! and in every shard of a run.

use alloc::string::String;
use alloc::vec::Vec;

use drt_math::{Real, Rgb};

use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::sensitivity::VelocityFunctional;
use crate::model::rendering::Account;
use crate::sampling::budget::{BESIDES, LOOKUP};
use crate::sampling::guide::Guide;
use crate::sampling::guide::learning::{Learnt, MOST_OBSERVATIONS, Observation, learn};
use crate::sampling::parallel::Pool;
use crate::sampling::streams::GUIDE_STREAM;
use crate::terms::boundary_segments::{BoundarySink, Strategy};
use crate::terms::boundary_source::BoundarySource;
use crate::terms::splatting::{Checked, Splatter};
use crate::world::World;

/// The part of a source's samples that its pilot takes at most.
const PART: f64 = 0.125;

/// Samples of the first round, of a batch, and the fewest of a pilot: as many as two batches.
const FIRST: usize = 4096;
const BATCH: usize = 512;

/// A pilot of so many samples stops where the gain is below 1 + [`HOPE`], one of n times as many below 1 + n [`HOPE`]: fewer
/// tell little of what more will.
const ENOUGH: usize = 16_384;
const HOPE: f64 = 0.03;

/// A receiver of samples that keeps how large they are.
pub(crate) trait Sizes: BoundarySink {
    /// The number of derivatives.
    fn derivatives(&self) -> usize;
    /// The squares of what was received since the last call, added up over pixels, per derivative.
    fn take(&mut self, squares: &mut [f64]);
}

/// What is known of a source, and where its samples go for that.
#[derive(Debug, Default)]
pub(crate) struct Guiding {
    observations: Vec<Observation>,
    /// Batches so far.
    batches: u32,
    /// Sums of the sizes of each derivative's samples, and the number of these.
    sizes: Vec<f64>,
    sized: f64,
    /// There is little to gain.
    settled: bool,
    learnt: Option<Learnt>,
}

/// A batch of a pilot.
struct Batch {
    observed: Vec<Observation>,
    sizes: Vec<f64>,
    account: Account,
}

impl Guiding {
    /// The guide, where there is one that helps.
    pub(crate) fn guide(&self) -> Option<&Guide> {
        self.learnt.as_ref()?.guide.as_ref()
    }

    /// Samples to one that is even: as many as cost the same, and no more than without a guide.
    pub(crate) fn share(&self) -> f64 {
        let learnt = self.learnt.as_ref().filter(|learnt| learnt.guide.is_some());
        learnt.map_or(1.0, |learnt| 1.0 / f64::max(learnt.cost, 1.0))
    }

    /// What was learnt, and the number of samples that it took.
    fn outcome(&self) -> Option<(&Learnt, u32)> {
        Some((self.learnt.as_ref()?, self.batches * BATCH as u32))
    }

    /// What is known, in words.
    pub(crate) fn describe(&self, source: BoundarySource) -> String {
        let name = match source {
            BoundarySource::Edges(Strategy::Primary) | BoundarySource::PrimaryEdges => {
                "camera boundary"
            }
            BoundarySource::Edges(Strategy::Direct) => "emitter boundary",
            BoundarySource::Edges(Strategy::Indirect) => "indirect boundary",
            BoundarySource::Borders => "pixel borders",
            BoundarySource::GrazingFlux => "grazing flux",
            BoundarySource::GrazingPaths => "paths that begin edge on",
            BoundarySource::LightPaths => "light paths",
        };
        let Some((learnt, samples)) = self.outcome() else {
            return alloc::format!("{name}: where a pilot finds that it helps");
        };
        match &learnt.guide {
            Some(guide) => alloc::format!(
                "{name}: {:.2} of the work by {:.2} of the samples, with a pilot of {samples} and {} cells",
                1.0 / learnt.gain,
                self.share(),
                guide.cells()
            ),
            None => alloc::format!(
                "{name}: no, a pilot of {samples} samples promises {:.2} of the work",
                1.0 / learnt.gain
            ),
        }
    }

    /// Learns what a run of so many `samples` in all can afford. The account is that of the pilot; false when it was
    /// cancelled.
    pub(crate) fn learn<S: Sizes>(
        &mut self,
        splatter: &Splatter<'_>,
        source: BoundarySource,
        samples: f64,
        pool: &Pool,
        sink: impl Fn() -> S + Sync,
        cancelled: impl Fn() -> bool,
    ) -> (Account, bool) {
        let mut account = Account::default();
        let affordable = usize::min((PART * samples) as usize, MOST_OBSERVATIONS);
        loop {
            let known = self.observations.len();
            let wanted = if known == 0 { FIRST } else { known };
            let round = usize::min(wanted, affordable.saturating_sub(known));
            // Less than half of what is known already would tell little more.
            let fewest = usize::max(known / 2, 2 * BATCH);
            if !source.is_guided() || self.settled || round < fewest {
                return (account, true);
            }
            let several = sink().derivatives() > 1;
            if several && self.sizes.is_empty() {
                // Units first; these samples were told none.
                if !self.round(splatter, source, 2, false, pool, &sink, &mut account) {
                    return (account, false);
                }
            }
            let batches = (round / BATCH) as u32;
            if !self.round(splatter, source, batches, true, pool, &sink, &mut account) {
                return (account, false);
            }
            let learnt = learn(&self.observations);
            let enough = self.observations.len() as f64 / ENOUGH as f64;
            self.settled = enough >= 1.0 && learnt.gain < 1.0 + HOPE * enough;
            self.learnt = Some(learnt);
            if cancelled() {
                return (account, false);
            }
        }
    }

    /// Takes so many batches of samples and keeps what they found, or only how large it was.
    #[allow(clippy::too_many_arguments)]
    fn round<S: Sizes>(
        &mut self,
        splatter: &Splatter<'_>,
        source: BoundarySource,
        batches: u32,
        keep: bool,
        pool: &Pool,
        sink: &(impl Fn() -> S + Sync),
        account: &mut Account,
    ) -> bool {
        let even = Guide::even();
        let guide = self.guide().unwrap_or(&even).clone();
        let units = self.units();
        let first = self.batches;
        let work = |b: u32| {
            let stream = GUIDE_STREAM | (source.stream() + u64::from(b));
            observe(splatter, source, &guide, stream, &units, sink())
        };
        let going = pool.ordered(first..first + batches, 4, work, |_, batch| {
            if keep {
                self.observations.extend(batch.observed);
            }
            self.sizes.resize(batch.sizes.len(), 0.0);
            self.sizes.iter_mut().zip(&batch.sizes).for_each(|(sum, s)| *sum += s);
            self.sized += BATCH as f64;
            account.add(batch.account);
            true
        });
        self.batches += batches;
        going
    }

    /// What each derivative's squares count by. A single one has no need of units.
    fn units(&self) -> Vec<f64> {
        let unit = |sum: &f64| {
            let mean = sum / self.sized;
            if mean > 0.0 { 1.0 / (mean * mean) } else { 0.0 }
        };
        if self.sizes.len() > 1 { self.sizes.iter().map(unit).collect() } else { Vec::new() }
    }
}

/// Takes a batch of samples.
fn observe<S: Sizes>(
    splatter: &Splatter<'_>,
    source: BoundarySource,
    guide: &Guide,
    stream: u64,
    units: &[f64],
    sink: S,
) -> Batch {
    let mut squares = alloc::vec![0.0; sink.derivatives()];
    let mut sizes = squares.clone();
    let mut observed = Vec::with_capacity(BATCH);
    let mut receiver = Checked::new(sink);
    let mut account = splatter.run_observed(
        source,
        Some(guide),
        stream,
        BATCH as u32,
        &mut receiver,
        |receiver, drawn, rays, lookups| {
            receiver.take(&mut squares);
            let density = 1.0 / drawn.inverse_density;
            let mut square = 0.0;
            for (p, s) in squares.iter().enumerate() {
                // The value was divided by the density.
                sizes[p] += Real::sqrt(*s);
                square += s * (density * density) * units.get(p).copied().unwrap_or(1.0);
            }
            let cost = BESIDES + rays as f64 + LOOKUP * lookups as f64;
            observed.push(Observation {
                point: drawn.point.map(|u| u as f32),
                weight: drawn.inverse_density as f32,
                cost: cost as f32,
                square: if square.is_finite() { square } else { 0.0 },
            });
        },
    );
    account.counters.guide_samples += BATCH as u64;
    Batch { observed, sizes, account }
}

/// Forward mode: how large each parameter's derivative is.
pub(crate) struct OfImages<'a> {
    contraction: Contraction<'a>,
    squares: Vec<f64>,
}

impl<'a> OfImages<'a> {
    pub(crate) fn new(world: &'a World, motion: &'a Motion) -> Self {
        let squares = alloc::vec![0.0; motion.parameters()];
        Self { contraction: Contraction::new(world, motion), squares }
    }
}

impl<'a> BoundarySink for OfImages<'a> {
    type Sink = Contraction<'a>;

    fn moves(&mut self, functional: &VelocityFunctional) -> bool {
        self.contraction.evaluate(functional)
    }

    fn receive(&mut self, _: u32, value: Rgb) {
        let size = value.dot(value);
        for (square, rate) in self.squares.iter_mut().zip(&self.contraction.rates) {
            *square += size * (rate.r * rate.r);
        }
    }

    fn spread(&mut self, _: &[(u32, f64)], _: impl FnOnce(&mut Contraction<'a>)) -> bool {
        true
    }
}

impl Sizes for OfImages<'_> {
    fn derivatives(&self) -> usize {
        self.squares.len()
    }

    fn take(&mut self, squares: &mut [f64]) {
        squares.copy_from_slice(&self.squares);
        self.squares.fill(0.0);
    }
}
