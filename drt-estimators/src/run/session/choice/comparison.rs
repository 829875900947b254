//! A comparison of the work of estimators by [a few samples](crate::run::session::term_samples) of all their terms.
//!
//! With the variance v_k and the cost c_k of a sample of term k, of which a run takes r_k to a path, the work of an
//! estimator is
//!
//! ```text
//! Σ_k r_k c_k × Σ_p Σ_k (v_kp / r_k) / V_p,
//! ```
//!
//! V_p being the least variance that any estimator has for the derivative with respect to parameter p, so that several derivatives count
//! alike. The variances are those of block means.
//!
//! The number of samples doubles until one estimator is left, or until they have cost a [part](PART) of what the run will. An
//! estimator is left out as soon as it is clear that it does not need much less work than the best one.
//!
//! Few samples seldom see the rare ones that make most of a variance, and where they see one they are far off in the other direction. With the
//! standard error s of a work, relative to the work W, which is near 1 where a single batch makes all of it, the work is
//! taken to be between W (1 - s)^[CLEAR] and W / (1 - s)^[CLEAR]. Rare samples are more frequent where edges are sampled as vertices see
//! them. So `path-space` is chosen unless another one's W / (1 - s)^[SURE] is less than [a part](WORTH_IT) of its W (1 - s).

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use drt_math::Real;

use crate::model::settings::EstimatorKind;
use crate::run::session::preparation::{Ground, Preparation};
use crate::run::session::term_samples::ratios;

/// The estimator that is taken unless another one needs much less work.
pub(super) const USUAL: EstimatorKind = EstimatorKind::PathSpace;

/// The part of another work that a work must not exceed to be much less.
const WORTH_IT: f64 = 0.8;

/// The part of a run's cost that samples of the pilot may have.
pub(super) const PART: f64 = 0.1;

/// Batches of each estimator before any but the costliest is left out.
const TRUSTED: u32 = 32;

/// The most batches of each estimator: more samples than these do not change the choice.
const MOST: u32 = 1024;

/// How many times the least cost an estimator may have to be looked at further.
const MOST_COSTLY: f64 = 8.0;

/// The powers of 1 minus the relative standard error by which a work may be larger or smaller where a candidate is left out before the end,
/// and by which it may be larger where it is chosen instead of the usual one.
const CLEAR: i32 = 4;
const SURE: i32 = 2;

/// The least value of 1 minus the relative standard error by which a work may be smaller.
const LEFT: f64 = 0.3;

/// An estimator whose variances are below this part of another's counts as if it had so much.
const LEAST: f64 = 1e-6;

/// An estimator that can be chosen.
pub(super) struct Candidate {
    pub(super) kind: EstimatorKind,
    pub(super) prepared: Preparation,
    /// False once it is clear that another one needs less work.
    open: bool,
}

/// The work of a candidate relative to the least one, and its standard error as a part of it.
#[derive(Clone, Copy)]
pub(super) struct Work {
    pub(super) ratio: f64,
    error: f64,
}

/// The candidate that is taken.
pub(super) fn best(candidates: &[Candidate], works: &[Work]) -> usize {
    let work = |i: &usize| works[*i].at_most(1);
    let others =
        (0..candidates.len()).filter(|i| candidates[*i].open && candidates[*i].kind != USUAL);
    let least = others.min_by(|a, b| work(a).total_cmp(&work(b)));
    let usual = candidates.iter().position(|c| c.open && c.kind == USUAL);
    let stays = |usual: usize, other: usize| {
        works[other].at_most(SURE) >= WORTH_IT * works[usual].at_least(1)
    };
    match (usual, least) {
        (Some(usual), Some(other)) if stays(usual, other) => usual,
        (_, Some(other)) => other,
        (usual, None) => usual.unwrap_or(0),
    }
}

/// The least cost that a candidate has for a path.
pub(super) fn cheapest(candidates: &[Candidate]) -> f64 {
    candidates.iter().map(Candidate::cost).fold(f64::INFINITY, f64::min)
}

/// Samples the candidates until it is clear which one is best, or until that has cost enough.
pub(super) fn compare(candidates: &mut [Candidate], ground: &Ground<'_>) -> Vec<Work> {
    let (mut count, cheapest) = (1, cheapest(candidates));
    for candidate in candidates.iter_mut() {
        candidate.open = candidate.cost() <= MOST_COSTLY * cheapest;
    }
    loop {
        let works = works(candidates);
        if count >= TRUSTED {
            settle(candidates, &works);
        }
        let spent: f64 = candidates.iter().map(Candidate::spent).sum();
        let more: f64 = open(candidates).map(|c| c.spent()).sum();
        let run = ground.paths_of_run() * candidates[best(candidates, &works)].cost();
        if open(candidates).count() < 2 || count >= MOST || spent + more > PART * run {
            return works;
        }
        count *= 2;
        open(candidates).for_each(|c| c.measure(count, ground));
    }
}

/// The candidates that are still looked at.
fn open(candidates: &mut [Candidate]) -> impl Iterator<Item = &mut Candidate> {
    candidates.iter_mut().filter(|c| c.open)
}

/// Closes the candidates that do not need much less work than the best one.
fn settle(candidates: &mut [Candidate], works: &[Work]) {
    let best = best(candidates, works);
    let enough = WORTH_IT * works[best].at_most(CLEAR);
    for (i, work) in works.iter().enumerate() {
        candidates[i].open &= i == best || work.at_least(CLEAR) < enough;
    }
}

impl Work {
    fn left(self) -> f64 {
        f64::max(1.0 - self.error, 0.0)
    }

    fn at_most(self, sure: i32) -> f64 {
        self.ratio / Real::powi(self.left(), sure)
    }

    fn at_least(self, sure: i32) -> f64 {
        // Works far below what samples show are unlikely, however few these are.
        self.ratio * Real::powi(f64::max(self.left(), LEFT), sure)
    }
}

/// The work of each candidate by what was sampled so far.
fn works(candidates: &[Candidate]) -> Vec<Work> {
    let variances: Vec<Vec<Vec<f64>>> = candidates.iter().map(Candidate::variances).collect();
    let mean = |batches: &[Vec<f64>], p: usize| {
        batches.iter().map(|b| b[p]).sum::<f64>() / batches.len() as f64
    };
    let parameters = variances.iter().flatten().map(Vec::len).min().unwrap_or(0);
    let units: Vec<f64> = (0..parameters)
        .map(|p| {
            let of_parameter = || variances.iter().map(|batches| mean(batches, p));
            let largest = of_parameter().fold(0.0, f64::max);
            f64::max(of_parameter().fold(f64::INFINITY, f64::min), LEAST * largest)
        })
        .collect();
    let mut works: Vec<Work> = Vec::new();
    for (candidate, batches) in candidates.iter().zip(&variances) {
        // Without any noise, each is as good.
        let part = |v: f64, unit: f64| if unit > 0.0 { f64::max(v / unit, LEAST) } else { 1.0 };
        let of_batch = |b: &Vec<f64>| b.iter().zip(&units).map(|(v, u)| part(*v, *u)).sum::<f64>();
        let sums: Vec<f64> = batches.iter().map(of_batch).collect();
        let count = sums.len() as f64;
        let work = sums.iter().sum::<f64>() / count;
        let scatter: f64 = sums.iter().map(|s| (s - work) * (s - work)).sum();
        let scatter = Real::sqrt(scatter / (count * (count - 1.0))) / work;
        // Noise that others have and this one has not may be noise that it has not shown yet.
        let unseen = (0..parameters).any(|p| units[p] > 0.0 && mean(batches, p) == 0.0);
        let error = if unseen || batches.len() < 2 { 1.0 } else { scatter };
        works.push(Work { ratio: work * candidate.cost(), error });
    }
    let least = works.iter().map(|w| w.ratio).fold(f64::INFINITY, f64::min);
    works.iter_mut().for_each(|w| w.ratio = if least > 0.0 { w.ratio / least } else { 1.0 });
    works
}

impl Candidate {
    pub(super) fn new(kind: EstimatorKind, prepared: Preparation, ground: &Ground<'_>) -> Self {
        let mut candidate = Self { kind, prepared, open: true };
        candidate.measure(1, ground);
        candidate
    }

    /// Samples it until it has so many batches.
    fn measure(&mut self, count: u32, ground: &Ground<'_>) {
        self.prepared.parts.iter_mut().for_each(|part| part.measure(count, &ground.pool));
    }

    /// The mean cost of a path and of the samples that a run takes with it.
    fn cost(&self) -> f64 {
        let mut sum = 0.0;
        for (i, part) in self.prepared.parts.iter().enumerate() {
            let mut ratios: Vec<f64> = ratios(&part.component.prepared).collect();
            if i > 0 {
                // All differentiate one path.
                ratios[0] = 0.0;
            }
            let terms = part.batches.iter().flat_map(|batch| batch.iter().zip(&ratios));
            let costs = terms.map(|(term, ratio)| ratio * term.cost);
            sum += costs.sum::<f64>() / part.batches.len() as f64;
        }
        sum
    }

    /// What its samples have cost so far.
    fn spent(&self) -> f64 {
        let terms = self.prepared.parts.iter().flat_map(|part| part.batches.iter().flatten());
        terms.map(|term| term.spent).sum::<f64>()
    }

    /// The variance that one path and what a run takes with it leave in each derivative, by batches.
    fn variances(&self) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = Vec::new();
        for part in &self.prepared.parts {
            let ratios: Vec<f64> = ratios(&part.component.prepared).collect();
            all.resize(part.batches.len(), Vec::new());
            for (sums, batch) in all.iter_mut().zip(&part.batches) {
                for (term, ratio) in batch.iter().zip(&ratios) {
                    sums.resize(term.blocks.len(), 0.0);
                    sums.iter_mut().zip(&term.blocks).for_each(|(sum, v)| *sum += v / ratio);
                }
            }
        }
        all
    }
}
