//! Sums of samples that come in runs, and what is known from them.

use alloc::vec::Vec;

use drt_math::{Real, Rgb};

use crate::model::rendering::Estimate;
use crate::sampling::film::Ends;
use crate::sampling::film::strata::{SampleSums, take_all};

/// Means of many numbers at once, with their standard errors: plain arrays with an entry for each.
///
/// Where samples have weights whose sum W has the mean 1, as of a pixel's filter, the noise of that is taken out of
/// their sum S: over the R runs of a pass, with c_r from all but run r,
///
/// ```text
/// (1/N) Σ_r N_r (S_r - c_r (W_r - 1)),     c_r = R/(R - 1) (1/N) Σ_{s≠r} N_s S_s,     N = Σ_r N_r.
/// ```
///
/// As runs are independent, that has the mean of S for any N: the unbiased estimator of a ratio by Hartley and Ross (1954,
/// "Unbiased ratio estimators"). S / W is as good, but has a bias of order 1/N.
///
/// In a pass, every number takes its samples in runs whose means are independent
/// ([`Pass`](crate::sampling::pixels::Pass)); passes are weighted by their samples. A pass of a single run
/// knows nothing of its error, and takes that of the others. The samples of a run are added up in strata, and the
/// sums of these in order: so where they were taken does not matter.
#[derive(Debug, Default)]
pub(super) struct RunSums {
    /// Passes before the last one; empty when there are none.
    passes: Vec<Passes>,
    /// Of weights, where there are such.
    pass_weights: Vec<PassWeights>,
    before: Count,
    /// The last pass, and of its current run the strata that are finished and the one that is not.
    runs: Vec<Runs>,
    partial: Vec<Rgb>,
    weights: Vec<RunWeights>,
    open: SampleSums,
    run_count: u32,
    run_units: u32,
    partial_units: u32,
}

/// Samples of each number in some passes, and how many of them have a known error.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    units: u32,
    known: u32,
}

/// Σ N mean over passes of N samples, and Σ N² variance over those whose errors are known.
#[derive(Clone, Copy, Debug)]
struct Passes {
    sum: Rgb,
    variance: Rgb,
}

impl Passes {
    const NONE: Self = Self { sum: Rgb::ZERO, variance: Rgb::ZERO };
}

/// The same of weights: Σ N² covariance with them, and variance of them.
#[derive(Clone, Copy, Debug)]
struct PassWeights {
    with: Rgb,
    own: f64,
}

impl PassWeights {
    const NONE: Self = Self { with: Rgb::ZERO, own: 0.0 };
}

/// Of weights: the sum over the finished strata of the current run, the mean of runs, the sum of deviations times those of samples
/// and times themselves, and Σ N_r² S_r (W_r - 1).
#[derive(Clone, Copy, Debug)]
struct RunWeights {
    partial: f64,
    mean: f64,
    with: [f32; 3],
    own: f32,
    products: Rgb,
}

impl RunWeights {
    const NONE: Self =
        Self { partial: 0.0, mean: 0.0, with: [0.0; 3], own: 0.0, products: Rgb::ZERO };

    /// Ends a run of samples of the mean `x`, of which those before it have the mean `before`.
    fn push(&mut self, x: Rgb, before: Rgb, length: f64, total: f64) {
        let w = self.partial / length;
        let delta = w - self.mean;
        self.mean += delta * (length / total);
        let rest = (w - self.mean) * length;
        for (sum, delta) in self.with.iter_mut().zip((x - before).to_array()) {
            *sum += (delta * rest) as f32;
        }
        self.own += (delta * rest) as f32;
        self.products += x * ((w - 1.0) * length * length);
        self.partial = 0.0;
    }

    /// What is to be added to the mean of `runs` runs of `units` samples.
    fn correction(&self, mean: Rgb, runs: f64, units: f64) -> Rgb {
        let plain = mean * (self.mean - 1.0) - self.products * (1.0 / (units * units));
        plain * (-runs / (runs - 1.0))
    }
}

/// Mean of the means of runs, each weighted by its length, and the weighted sum of their squared
/// deviations from it (West 1979, "Updating mean and variance estimates").
#[derive(Clone, Copy, Debug)]
struct Runs {
    mean: Rgb,
    m2: [f32; 3],
}

impl Runs {
    const NONE: Self = Self { mean: Rgb::ZERO, m2: [0.0; 3] };

    /// Takes in a run of a given length that makes the length of all `total`.
    fn push(&mut self, x: Rgb, length: f64, total: f64) {
        let delta = x - self.mean;
        self.mean += delta * (length / total);
        let m2 = (delta * (x - self.mean) * length).to_array();
        for (sum, m2) in self.m2.iter_mut().zip(m2) {
            *sum += m2 as f32;
        }
    }
}

impl RunSums {
    pub(super) fn new(n: usize) -> Self {
        Self {
            runs: alloc::vec![Runs::NONE; n],
            partial: alloc::vec![Rgb::ZERO; n],
            open: SampleSums::new(n),
            ..Self::default()
        }
    }

    /// With weights.
    pub(super) fn weighted(n: usize) -> Self {
        Self {
            weights: alloc::vec![RunWeights::NONE; n],
            open: SampleSums::weighted(n),
            ..Self::new(n)
        }
    }

    /// How many numbers there are.
    pub(super) fn len(&self) -> usize {
        self.runs.len()
    }

    /// Samples that every number has received.
    pub(super) fn units(&self) -> u32 {
        self.before.units + self.run_units + self.partial_units
    }

    /// Forgets all samples.
    pub(super) fn clear(&mut self) {
        self.passes.clear();
        self.pass_weights.clear();
        self.before = Count::default();
        self.clear_last();
    }

    fn clear_last(&mut self) {
        self.runs.fill(Runs::NONE);
        self.partial.fill(Rgb::ZERO);
        self.weights.fill(RunWeights::NONE);
        self.open.clear();
        (self.run_count, self.run_units, self.partial_units) = (0, 0, 0);
    }

    /// Begins a pass.
    pub(super) fn begin(&mut self) {
        let count = self.count();
        if count.units == 0 {
            return;
        }
        self.passes.resize(self.runs.len(), Passes::NONE);
        self.pass_weights.resize(self.weights.len(), PassWeights::NONE);
        for i in 0..self.runs.len() {
            let (passes, weights) = self.passes_with_last(i);
            self.passes[i] = passes;
            if let Some(own) = self.pass_weights.get_mut(i) {
                *own = weights;
            }
        }
        self.before = count;
        self.clear_last();
    }

    /// Adds sums of samples to the numbers from `at` on; the order of adding is part of the result's bits.
    pub(super) fn add_from(&mut self, at: usize, sums: &[Rgb]) {
        for (sum, t) in self.open.values[at..].iter_mut().zip(sums) {
            *sum += *t;
        }
    }

    /// The same to all numbers, and their weights.
    pub(super) fn add(&mut self, sums: &SampleSums) {
        self.open.add(sums);
    }

    /// The same, and zeros those sums.
    pub(super) fn take(&mut self, sums: &mut SampleSums) {
        self.open.take(sums);
    }

    /// What the stratum that has not ended holds; it begins anew.
    pub(super) fn take_open(&mut self) -> SampleSums {
        let empty = self.open.empty();
        core::mem::replace(&mut self.open, empty)
    }

    /// Counts samples that every number has received, and what ends with them.
    pub(super) fn advance(&mut self, units: u32, ends: Ends) {
        self.partial_units += units;
        if ends == Ends::Nothing {
            return;
        }
        take_all(&mut self.partial, &mut self.open.values);
        for (weights, w) in self.weights.iter_mut().zip(&mut self.open.weights) {
            weights.partial += core::mem::take(w);
        }
        if ends == Ends::Run {
            self.end_run();
        }
    }

    /// Forgets a run that was not finished.
    pub(super) fn abandon_run(&mut self) {
        self.partial.fill(Rgb::ZERO);
        self.weights.iter_mut().for_each(|w| w.partial = 0.0);
        self.open.clear();
        self.partial_units = 0;
    }

    /// Ends the current run, unless it has no samples.
    pub(super) fn end_run(&mut self) {
        if self.partial_units == 0 {
            return;
        }
        self.run_count += 1;
        self.run_units += self.partial_units;
        let (length, total) = (f64::from(self.partial_units), f64::from(self.run_units));
        for (i, (runs, sum)) in self.runs.iter_mut().zip(&mut self.partial).enumerate() {
            let (mean, before) = (*sum * (1.0 / length), runs.mean);
            runs.push(mean, length, total);
            if let Some(weights) = self.weights.get_mut(i) {
                weights.push(mean, before, length, total);
            }
            *sum = Rgb::ZERO;
        }
        self.partial_units = 0;
    }

    /// Samples of all passes, the last one included.
    fn count(&self) -> Count {
        let last = self.run_units + self.partial_units;
        let known = if self.run_count < 2 { 0 } else { last };
        Count { units: self.before.units + last, known: self.before.known + known }
    }

    /// The sums of all passes, the last one included.
    fn passes_with_last(&self, i: usize) -> (Passes, PassWeights) {
        let mut passes = self.passes.get(i).copied().unwrap_or(Passes::NONE);
        let mut of_weights = self.pass_weights.get(i).copied().unwrap_or(PassWeights::NONE);
        let units = f64::from(self.run_units);
        let mut mean = self.runs[i].mean;
        if self.run_count >= 2 {
            let runs = f64::from(self.run_count);
            // The unfinished run is as uncertain, by its length, as those before it.
            let all = units + f64::from(self.partial_units);
            let scale = all / (runs - 1.0);
            passes.variance += Rgb::from(self.runs[i].m2.map(f64::from)) * scale;
            if let Some(weights) = self.weights.get(i) {
                of_weights.with += Rgb::from(weights.with.map(f64::from)) * scale;
                of_weights.own += f64::from(weights.own) * scale;
                mean += weights.correction(mean, runs, units);
            }
        }
        passes.sum += mean * units + (self.partial[i] + self.open.values[i]);
        (passes, of_weights)
    }

    /// One of the numbers.
    pub(super) fn estimate(&self, i: usize) -> Estimate {
        let units = self.count().units;
        if units == 0 {
            return Estimate { mean: Rgb::ZERO, stderr: Rgb::splat(f64::INFINITY) };
        }
        let mean = self.passes_with_last(i).0.sum * (1.0 / f64::from(units));
        Estimate { mean, stderr: self.stderr(i, mean) }
    }

    /// The standard error of one of the numbers from whose samples `c` times their weights is taken away.
    pub(super) fn stderr(&self, i: usize, c: Rgb) -> Rgb {
        let count = self.count();
        if count.known == 0 {
            return Rgb::splat(f64::INFINITY);
        }
        let (passes, weights) = self.passes_with_last(i);
        let mut variance = passes.variance;
        if !self.weights.is_empty() {
            variance += c * (c * weights.own - weights.with * 2.0);
        }
        let scale = 1.0 / (f64::from(count.known) * f64::from(count.units));
        (variance * scale).map(|v| Real::sqrt(f64::max(v, 0.0)))
    }
}
