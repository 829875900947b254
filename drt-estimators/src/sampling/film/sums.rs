//! Sums of samples that come in runs, and what is known from them.

use alloc::vec::Vec;

use drt_math::{Real, Rgb};

use crate::model::rendering::Estimate;

/// Means of many numbers at once, with their standard errors: plain arrays with an entry for each.
///
/// In a pass, every number takes its samples in runs whose means are independent
/// ([`Pass`](crate::sampling::pixels::Pass)); passes are weighted by their samples. A pass of a single run
/// knows nothing of its error, and takes that of the others.
#[derive(Debug, Default)]
pub(super) struct RunSums {
    /// Passes before the last one; empty when there are none.
    passes: Vec<Passes>,
    before: Count,
    /// The last pass, and of its current run what is finished.
    runs: Vec<Runs>,
    partial: Vec<Rgb>,
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
            ..Self::default()
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
        self.before = Count::default();
        self.clear_last();
    }

    fn clear_last(&mut self) {
        self.runs.fill(Runs::NONE);
        self.partial.fill(Rgb::ZERO);
        (self.run_count, self.run_units, self.partial_units) = (0, 0, 0);
    }

    /// Begins a pass.
    pub(super) fn begin(&mut self) {
        let count = self.count();
        if count.units == 0 {
            return;
        }
        self.passes.resize(self.runs.len(), Passes::NONE);
        for i in 0..self.runs.len() {
            self.passes[i] = self.passes_with_last(i);
        }
        self.before = count;
        self.clear_last();
    }

    /// Adds sums of samples to the numbers from `at` on; the order of adding is part of the result's bits.
    pub(super) fn add(&mut self, at: usize, sums: &[Rgb]) {
        for (sum, t) in self.partial[at..].iter_mut().zip(sums) {
            *sum += *t;
        }
    }

    /// Counts samples that every number has received; with them a run may end.
    pub(super) fn advance(&mut self, units: u32, ends_run: bool) {
        self.partial_units += units;
        if !ends_run {
            return;
        }
        self.run_count += 1;
        self.run_units += self.partial_units;
        let (length, total) = (f64::from(self.partial_units), f64::from(self.run_units));
        for (runs, sum) in self.runs.iter_mut().zip(&mut self.partial) {
            runs.push(*sum * (1.0 / length), length, total);
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
    fn passes_with_last(&self, i: usize) -> Passes {
        let mut passes = self.passes.get(i).copied().unwrap_or(Passes::NONE);
        let units = f64::from(self.run_units);
        passes.sum += self.runs[i].mean * units + self.partial[i];
        if self.run_count >= 2 {
            // The unfinished run is as uncertain, by its length, as those before it.
            let all = units + f64::from(self.partial_units);
            let scale = all / f64::from(self.run_count - 1);
            passes.variance += Rgb::from(self.runs[i].m2.map(f64::from)) * scale;
        }
        passes
    }

    /// One of the numbers.
    pub(super) fn estimate(&self, i: usize) -> Estimate {
        let count = self.count();
        if count.units == 0 {
            return Estimate { mean: Rgb::ZERO, stderr: Rgb::splat(f64::INFINITY) };
        }
        let passes = self.passes_with_last(i);
        let (units, known) = (f64::from(count.units), f64::from(count.known));
        let stderr = match count.known {
            0 => Rgb::splat(f64::INFINITY),
            _ => (passes.variance * (1.0 / (known * units))).map(Real::sqrt),
        };
        Estimate { mean: passes.sum * (1.0 / units), stderr }
    }
}
