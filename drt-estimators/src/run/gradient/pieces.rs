//! The work of a gradient in pieces, which threads take in any order and whose sums are added up in one.

use alloc::vec::Vec;
use core::ops::Range;

use drt_math::Rgb;

use crate::derivative::sensitivity::VelocityFunctional;
use crate::model::shard::Shard;
use crate::run::component::{Component, seed_of_component};
use crate::run::gradient::everything::Everything;
use crate::run::gradient::sink::{ScatterSink, Sums, ToGradient};
use crate::run::gradient::{PreparedGradient, Sampling};
use crate::sampling::film::BATCHES;
use crate::sampling::pixels::{Part, Pass, Sampler};
use crate::terms::interior::PixelSampler;
use crate::terms::splatting::Checked;

/// All work of a gradient.
pub(super) struct Pieces<'a> {
    pub(super) of: &'a PreparedGradient,
    pub(super) sampling: &'a Sampling<'a>,
    pub(super) pass: Pass,
    /// True when pieces of work shall end before they are done, to be thrown away.
    pub(super) cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// A piece of work.
pub(super) struct Piece {
    /// What of the samples of pixels its batch has.
    pub(super) part: Part,
    pub(super) work: Work,
    /// The last one of its batch.
    pub(super) last: bool,
}

pub(super) enum Work {
    /// Samples of the pixels from the first one on, up to the second one.
    Pixels([u32; 2]),
    /// Component, source and batch.
    Splats(usize, usize, u32),
}

impl Pieces<'_> {
    pub(super) fn zeros(&self) -> Vec<Sums> {
        let zeros = |c: &Component<Everything>| Sums::zeros(&c.prepared.world, &c.unknowns);
        self.of.components.iter().map(zeros).collect()
    }

    /// The batches of boundary samples that go with a part of those of pixels.
    pub(super) fn batches(&self, part: u32) -> Range<u32> {
        let at = |k: u32| k * BATCHES as u32 / self.pass.parts();
        at(part)..at(part + 1)
    }

    /// The work of all batches, or of those of a shard, in order.
    pub(super) fn list(&self, shard: Option<Shard>) -> Vec<Piece> {
        let mut parts: Vec<Part> = self.pass.strata(shard).collect();
        parts.sort_by_key(|part| part.number);
        let chunks = (BATCHES as u32).div_ceil(self.pass.parts());
        let n = self.sampling.adjoint.len() as u64;
        let at = |c: u32| (n * u64::from(c) / u64::from(chunks)) as u32;
        let mut pieces = Vec::new();
        for part in parts {
            let mut push = |work| pieces.push(Piece { part, work, last: false });
            (0..chunks).for_each(|c| push(Work::Pixels([at(c), at(c + 1)])));
            for (c, component) in self.of.components.iter().enumerate() {
                for source in 0..component.sources().len() {
                    self.batches(part.number).for_each(|b| push(Work::Splats(c, source, b)));
                }
            }
            if let Some(piece) = pieces.last_mut() {
                piece.last = true;
            }
        }
        pieces
    }

    /// What a piece of work adds to which component.
    pub(super) fn take(&self, piece: &Piece) -> Vec<(usize, Sums)> {
        match piece.work {
            Work::Pixels(pixels) => self.pixels(&piece.part, pixels),
            Work::Splats(component, source, batch) => self.splats(component, source, batch),
        }
    }

    /// Samples of some pixels; what they add to which component.
    fn pixels(&self, part: &Part, [first, last]: [u32; 2]) -> Vec<(usize, Sums)> {
        let PreparedGradient { paths, components, emission, antithetic, .. } = self.of;
        let Sampling { seed, adjoint, .. } = *self.sampling;
        let per_unit = if *antithetic { 2 } else { 1 };
        let scale = 1.0 / f64::from(self.pass.all() * per_unit);
        let components = components.iter().map(|c| c.prepared.component(scatter(c)));
        let start = self.pass.units(part.run).start;
        let units = part.units[0] - start..part.units[1] - start;
        let mut sampler = PixelSampler::new(paths, components, seed, *antithetic, false)
            .with_light_paths(emission.as_ref());
        let mut values = [Rgb::ZERO];
        for pixel in first..last {
            for sink in sampler.sinks() {
                sink.weights = adjoint[pixel as usize] * scale;
            }
            self.pass.sample(seed, pixel, part.run, units.clone(), 1, |unit, points| {
                if !(self.cancelled)() {
                    sampler.sample(pixel, unit, points, &mut values);
                }
            });
        }
        let (account, sinks) = sampler.finish();
        let mut sums: Vec<_> = sinks.into_iter().map(|sink| sink.sums).enumerate().collect();
        if let Some((_, first)) = sums.first_mut() {
            first.scene.counters = account.counters;
            first.scene.non_finite += account.non_finite_count;
        }
        sums
    }

    /// One batch of a source of boundary samples; what it adds to its component.
    fn splats(&self, c: usize, i: usize, batch: u32) -> Vec<(usize, Sums)> {
        let Sampling { seed, spp, adjoint, .. } = *self.sampling;
        let component = &self.of.components[c];
        let source = component.sources()[i];
        let ratio = component.prepared.source_ratio(i);
        let count = component.per_batch(i, f64::from(spp) * ratio);
        let scale = 1.0 / (f64::from(count) * BATCHES as f64);
        let mut receiver = Checked::new(ToGradient {
            scatter: scatter(component),
            adjoint,
            functional: VelocityFunctional::default(),
            weight: 0.0,
            scale,
        });
        let stream = source.stream() + u64::from(batch);
        let seed = seed_of_component(seed, c);
        let splatter = component.prepared.splatter(&self.of.paths, seed).until(self.cancelled);
        let guide = component.guiding(i).guide();
        let account = splatter.run(source, guide, stream, count, &mut receiver);
        let mut to = receiver.inner;
        to.flush();
        let mut sums = to.scatter.sums;
        sums.scene.counters = account.counters;
        sums.scene.non_finite += account.non_finite_count;
        alloc::vec![(c, sums)]
    }
}

fn scatter(component: &Component<Everything>) -> ScatterSink<'_> {
    let Component { prepared, unknowns, .. } = component;
    ScatterSink {
        world: &prepared.world,
        active: &unknowns.active,
        insides: &unknowns.insides,
        weights: Rgb::ZERO,
        sums: Sums::zeros(&prepared.world, unknowns),
    }
}
