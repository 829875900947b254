//! The samples of a pass: how they are spread over pixels, Sobol' sequences and pieces of work.

use alloc::vec::Vec;
use core::ops::Range;

use drt_math::Rgb;
use drt_math::sobol::SobolSampler;

use crate::model::rendering::BLOCKS;
use crate::model::shard::{Shard, has};
use crate::sampling::allocation::{Allocation, MOST};
use crate::sampling::film::{BATCHES, Ends, PixelFilm, Splat, SplatTile, Tile};
use crate::sampling::parallel::Pool;
use crate::sampling::streams::sequence_name;

/// Pixels of a tile.
const TILE: u32 = 256;
/// Samples of one piece of work.
const WORK: u32 = 1 << 12;
/// Most pieces that the samples of a round are cut into.
const CUTS: u32 = 256;
/// Samples after which a small film is looked at again.
const SLICE: u32 = 1 << 18;
/// Fewest sequences of a pixel: what its own standard error is estimated from, to some 40 %.
const FEWEST: u32 = 4;
/// Sequences of all the pixels of a block: what the block's standard error is estimated from.
const OF_A_BLOCK: u32 = 64;

/// A pass over the film: the samples that each pixel takes, in runs with a Sobol' sequence each.
///
/// The means of a pixel's runs are independent, so their scatter is an honest error; the longer the
/// runs, the more their points gain from being evenly spread. Pixels are independent, too: where a
/// block has many, few runs each do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pass {
    /// Samples of each pixel before this pass.
    first: u32,
    units: u32,
    runs: u32,
    /// Parts of a run that are added up by themselves.
    strata: u32,
}

/// A part of the samples that is added up by itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// Its number: the first ones are those of all runs, and so on, so that some neighbours see every run.
    pub(crate) number: u32,
    pub(crate) run: u32,
    /// First sample and one past the last, counted from the start of the pass.
    pub(crate) units: [u32; 2],
    ends_run: bool,
}

impl Pass {
    pub(crate) fn new(first: u32, units: u32, [w, h]: [u32; 2]) -> Self {
        let per_block = (w * h / (BLOCKS * BLOCKS) as u32).max(1);
        let runs = (OF_A_BLOCK / per_block).clamp(FEWEST, OF_A_BLOCK / 2);
        let runs = u32::min(runs, units);
        let strata = (BATCHES as u32 / runs.max(1)).clamp(1, (units / runs.max(1)).max(1));
        Self { first, units, runs, strata }
    }

    /// Samples of each pixel.
    pub(crate) fn all(&self) -> u32 {
        self.units
    }

    /// How many parts there are, at most [`BATCHES`].
    pub(crate) fn parts(&self) -> u32 {
        self.runs * self.strata
    }

    /// All parts, or those of a shard, in the order in which they are added up.
    pub(crate) fn strata(&self, shard: Option<Shard>) -> impl Iterator<Item = Part> {
        let pass = *self;
        let parts = pass.runs().flat_map(move |run| (0..pass.strata).map(move |s| (run, s)));
        let part = move |(run, s)| {
            let of_run = pass.units(run);
            let at = |s: u32| {
                let n = u64::from(of_run.end - of_run.start);
                of_run.start + (n * u64::from(s) / u64::from(pass.strata)) as u32
            };
            let (number, ends_run) = (s * pass.runs + run, s + 1 == pass.strata);
            Part { number, run, units: [at(s), at(s + 1)], ends_run }
        };
        parts.map(part).filter(move |part| has(shard, pass.parts(), part.number))
    }

    pub(crate) fn runs(&self) -> Range<u32> {
        0..self.runs
    }

    /// Samples of a run, counted from the start of the pass.
    pub(crate) fn units(&self, run: u32) -> Range<u32> {
        let at = |r: u32| (u64::from(self.units) * u64::from(r) / u64::from(self.runs)) as u32;
        at(run)..at(run + 1)
    }
}

impl Part {
    /// True for the last part of a run.
    pub(crate) fn ends_run(&self) -> bool {
        self.ends_run
    }
}

/// What takes the samples of a pixel.
pub(crate) trait Sampler {
    /// Sample `unit` of a pixel, with the leading random numbers `points`: fills in a value per layer.
    fn sample(&mut self, pixel: u32, unit: u32, points: SobolSampler, values: &mut [Rgb]);

    /// What the last sample splats on the first layer, besides its value for the pixel.
    fn splats(&self) -> &[Splat] {
        &[]
    }
}

impl Pass {
    /// Samples `units` of one run, counted from its start, for one pixel, whose runs have names for `spread`
    /// times their length.
    pub(crate) fn sample(
        &self,
        seed: u64,
        pixel: u32,
        run: u32,
        units: Range<u32>,
        spread: u32,
        mut each: impl FnMut(u32, SobolSampler),
    ) {
        // Runs have no more numbers than samples have, so the names of all passes differ.
        let name = sequence_name(seed, pixel, self.first + run);
        let first = (self.first + self.units(run).start).wrapping_mul(spread);
        for unit in units {
            each(first.wrapping_add(unit), SobolSampler::new(name, unit));
        }
    }
}

/// A part of a run that every pixel takes before any takes more, or is left out: one that was cut
/// short would leave pixels with different numbers of samples.
struct Round {
    part: Part,
    units: Range<u32>,
    ends: Ends,
}

fn rounds(pass: &Pass, most: u32, shard: Option<Shard>) -> Vec<Round> {
    let mut rounds = Vec::new();
    for part in pass.strata(shard) {
        let [mut start, last] = part.units;
        while start < last {
            let end = u32::min(start.saturating_add(most), last);
            let ends = match end == last {
                false => Ends::Nothing,
                true if part.ends_run => Ends::Run,
                true => Ends::Stratum,
            };
            rounds.push(Round { part, units: start..end, ends });
            start = end;
        }
    }
    rounds
}

/// What the film is filled by.
pub(crate) struct Filling<'a, W> {
    pub(crate) pool: &'a Pool,
    pub(crate) seed: u64,
    /// What of the samples each pixel takes; as many as any other by default.
    pub(crate) allocation: Option<&'a Allocation>,
    /// The part of the samples that is taken, into strata that the film keeps apart; all where it is not said.
    pub(crate) shard: Option<Shard>,
    /// Makes the sampler of a piece of work.
    pub(crate) sampler: W,
    /// True when a piece of work shall end before it is done; from then on always, and then `finished` says so, too.
    pub(crate) cancelled: &'a (dyn Fn() -> bool + Sync),
}

impl<W> Filling<'_, W> {
    /// Takes a pass of samples. `finished` gets every sampler after its work, in order, and says
    /// whether to go on, with the part of the work that is done; `shown` gets the film and each range
    /// of pixels that a round has added to. Returns the samples of each pixel that were finished; of a shard all
    /// that there would be in one piece, or none.
    pub(crate) fn fill<S: Sampler + Send>(
        &self,
        film: &mut PixelFilm,
        units: u32,
        mut finished: impl FnMut(S, f64) -> bool,
        mut shown: impl FnMut(&PixelFilm, Range<u32>),
    ) -> u32
    where
        W: Fn() -> S + Sync,
    {
        let [w, h] = film.size();
        let (count, layers) = (w * h, film.layers());
        let pass = Pass::new(film.units(), units, [w, h]);
        // Pixels that take different numbers are equal only after whole runs.
        let most = match self.allocation {
            None => (units / 16).clamp(1, u32::max(32, SLICE / count)),
            Some(_) => u32::MAX,
        };
        let rounds = rounds(&pass, most, self.shard);
        let tiles = count.div_ceil(TILE);
        let range = |t: u32| t * TILE..u32::min(count, (t + 1) * TILE);
        // A film of few pixels is cut into samples as well.
        let longest = rounds.iter().map(|r| r.units.len() as u32).max().unwrap_or(1);
        let per_work = u32::max(WORK / u32::min(count, TILE), longest.div_ceil(CUTS)).max(1);
        let cuts = if tiles > CUTS { 1 } else { longest.div_ceil(per_work) };
        let works = tiles * cuts;
        let all = works.saturating_mul(rounds.len() as u32);
        let spread = if self.allocation.is_some() { MOST } else { 1 };
        let raster = film.raster().cloned();
        let work = |i: u32| {
            let (round, t, cut) = (&rounds[(i / works) as usize], i / cuts % tiles, i % cuts);
            let of_run = pass.units(round.part.run);
            let [start, end] = [round.units.start, round.units.end].map(|u| u - of_run.start);
            let given = of_run.len() as u32;
            let mut tile = Tile::new(range(t), layers);
            let mut image = raster.as_ref().map(|raster| SplatTile::new(raster, range(t)));
            let mut sampler = (self.sampler)();
            let mut values = alloc::vec![Rgb::ZERO; layers];
            let mut whole = true;
            for pixel in range(t) {
                if let Some(image) = &mut image {
                    image.begin(pixel);
                }
                let taken = self.allocation.map_or(given, |a| a.taken(pixel, given));
                let part =
                    |n: u32, i: u32, of: u32| (u64::from(n) * u64::from(i) / u64::from(of)) as u32;
                let [first, last] = [start, end].map(|u| part(taken, u, given));
                let at = |cut: u32| first + part(last - first, cut, cuts);
                let weight = f64::from(given) / f64::from(taken);
                let units = at(cut)..at(cut + 1);
                pass.sample(self.seed, pixel, round.part.run, units, spread, |unit, points| {
                    whole = whole && !(self.cancelled)();
                    if !whole {
                        return;
                    }
                    sampler.sample(pixel, unit, points, &mut values);
                    if taken != given {
                        values.iter_mut().for_each(|v| *v *= weight);
                    }
                    tile.push(pixel, &values);
                    if let Some(image) = &mut image {
                        for splat in sampler.splats() {
                            image.add(&splat.scaled(weight));
                        }
                    }
                });
            }
            whole.then_some((tile, image, sampler))
        };
        let mut waiting = Vec::new();
        let before = film.units();
        film.begin();
        let going = self.pool.ordered(0..all, 4, work, |i, piece| {
            let Some((tile, image, sampler)) = piece else { return false };
            waiting.push(tile);
            if let Some(image) = &image {
                film.splat(image);
            }
            let going = finished(sampler, f64::from(i + 1) / f64::from(all));
            if (i + 1) % works == 0 {
                let round = &rounds[(i / works) as usize];
                for tile in waiting.drain(..) {
                    film.merge(&tile);
                }
                match self.shard {
                    None => film.advance(round.units.len() as u32, round.ends),
                    Some(_) => film.keep(round.part.number, round.ends),
                }
                if self.shard.is_none() && (self.allocation.is_none() || round.ends == Ends::Run) {
                    for t in 0..tiles {
                        shown(film, range(t));
                    }
                }
            }
            going
        });
        match self.shard {
            Some(_) if going => units,
            Some(_) => 0,
            None => {
                if !going && self.allocation.is_some() {
                    film.abandon_run();
                }
                film.units() - before
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_share_out_all_samples() {
        for (units, size) in [(1, [64, 64]), (7, [64, 64]), (103, [16, 16]), (1 << 20, [1, 1])] {
            let pass = Pass::new(5, units, size);
            let mut next = 0;
            for r in pass.runs() {
                assert_eq!(pass.units(r).start, next);
                assert!(!pass.units(r).is_empty());
                next = pass.units(r).end;
            }
            assert_eq!(next, units);
            let lengths: Vec<u32> =
                rounds(&pass, 13, None).iter().map(|r| r.units.len() as u32).collect();
            assert_eq!(lengths.iter().sum::<u32>(), units);
        }
    }
}
