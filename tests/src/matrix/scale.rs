//! By how much one derivative is larger than another as a whole.
//!
//! Block by block, noise hides errors of its own size. An error that all blocks share, a factor that is off
//! by a percent, shows in their sum long before: with weights w,
//!
//! ```text
//! s = Σ w·a / Σ w·b - 1
//! ```
//!
//! is 0 but for noise where a and b estimate the same image. It is known best with weights in proportion to the
//! image over its variance. Those come from the first half of the samples where the second is judged and the
//! other way round, so that no noise meets itself: the numerator's mean is that of a - b, whatever
//! the weights. The variances of the weights are half those of their block and half the mean of all, lest
//! blocks whose rare samples have not been seen yet decide alone.

use std::ops::Mul;

use drt_estimators::{Estimate, Layer};
use drt_math::Rgb;

/// A number with its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// What one is larger than the other by, as a part of it.
    pub off: f64,
    /// Of that.
    pub stderr: f64,
}

/// An image as of all samples, and as of the first half of them.
#[derive(Clone, Copy, Debug)]
pub struct Halves<'a> {
    /// Of the first half.
    pub first: &'a Layer,
    /// Of all.
    pub all: &'a Layer,
}

/// A block in one of the halves.
type Half = Vec<Estimate>;

impl Scale {
    /// Compares independent estimates.
    #[must_use]
    pub fn new(a: Halves<'_>, b: Halves<'_>) -> Self {
        let [a1, a2] = a.split();
        let [b1, b2] = b.split();
        let (mut difference, mut size, mut variance) = (0.0, 0.0, 0.0);
        for ([a, b], [like_a, like_b]) in [([&a2, &b2], [&a1, &b1]), ([&a1, &b1], [&a2, &b2])] {
            for ((w, a), b) in weights(like_a, like_b).into_iter().zip(a).zip(b) {
                difference += w.dot(a.mean - b.mean);
                size += w.dot(b.mean);
                variance += weighted_error(w, a).powi(2) + weighted_error(w, b).powi(2);
            }
        }
        Self { off: difference / size, stderr: variance.sqrt() / size.abs() }
    }

    /// Compares an estimate with a finite difference, and with what doubling the step `changes` it by. A third of that
    /// is the error of the second order, which is taken away; how much this moves the scale counts as an error.
    #[must_use]
    pub fn against(a: Halves<'_>, b: &Layer, changes: &Layer) -> Self {
        let [first, second] = &a.split();
        let of_first = weights_of(first);
        let of_second = weights_of(second);
        let (mut difference, mut size, mut variance, mut bias) = (0.0, 0.0, 0.0, 0.0);
        for (k, (b, change)) in b.blocks.iter().zip(&changes.blocks).enumerate() {
            let correction = change.mean * (1.0 / 3.0);
            let mean = b.mean - correction;
            // Weights come from the half that is not judged by them.
            for (w, a) in [(of_first[k], &second[k]), (of_second[k], &first[k])] {
                difference += w.dot(a.mean - mean);
                size += w.dot(mean);
                variance += weighted_error(w, a).powi(2);
                bias += w.dot(correction);
            }
            variance += weighted_error(of_first[k] + of_second[k], b).powi(2);
        }
        Self { off: difference / size, stderr: variance.sqrt().hypot(bias) / size.abs() }
    }

    /// How well one estimate alone is known, as a part of it.
    #[must_use]
    pub fn noise(a: Halves<'_>) -> f64 {
        let [first, second] = &a.split();
        let (mut size, mut variance) = (0.0, 0.0);
        for (a, like) in [(second, first), (first, second)] {
            for (w, e) in weights(like, like).into_iter().zip(a) {
                size += w.dot(e.mean);
                variance += weighted_error(w, e).powi(2);
            }
        }
        variance.sqrt() / f64::abs(size)
    }

    /// In standard errors.
    #[must_use]
    pub fn z(&self) -> f64 {
        if self.off == 0.0 { 0.0 } else { self.off.abs() / self.stderr }
    }
}

/// In another unit.
impl Mul<f64> for Scale {
    type Output = Self;

    fn mul(self, part: f64) -> Self {
        Self { off: self.off * part, stderr: self.stderr * part }
    }
}

impl Halves<'_> {
    fn split(&self) -> [Half; 2] {
        let second = |(first, all): (&Estimate, &Estimate)| Estimate {
            mean: all.mean * 2.0 - first.mean,
            // The variance of a mean of two is a quarter of theirs.
            stderr: (all.stderr * all.stderr * 4.0 - first.stderr * first.stderr)
                .map(|variance| variance.max(0.0).sqrt()),
        };
        let blocks = self.first.blocks.iter().zip(&self.all.blocks);
        [self.first.blocks.clone(), blocks.map(second).collect()]
    }
}

/// Of a weighted sum over the channels of a block, which come from the same paths.
fn weighted_error(w: Rgb, e: &Estimate) -> f64 {
    w.map(f64::abs).dot(e.stderr)
}

/// Weights for the blocks of one half, from that half alone.
fn weights_of(a: &Half) -> Vec<Rgb> {
    weights(a, a)
}

/// By what has been seen of both.
fn weights(a: &Half, b: &Half) -> Vec<Rgb> {
    let blocks = || a.iter().zip(b);
    let of = |(a, b): (&Estimate, &Estimate)| a.stderr.dot(a.stderr) + b.stderr.dot(b.stderr);
    let mean = blocks().map(of).sum::<f64>() / a.len().max(1) as f64;
    // Without any noise all blocks count alike.
    let exact = f64::from(u8::from(mean == 0.0));
    blocks().map(|(a, b)| (a.mean + b.mean) / (of((a, b)) + mean + exact)).collect()
}

#[cfg(test)]
mod tests {
    use drt_estimators::Tail;
    use drt_math::Rng;

    use super::*;

    const TRIALS: u64 = 400;

    /// An image of 64 blocks that is a factor times another, by halves. Its noise is of samples of which few
    /// are large, in some blocks fewer.
    fn measured(factor: f64, rng: &mut Rng) -> [Layer; 2] {
        let mut half = || -> Vec<Estimate> {
            let mut block = |i: u32| {
                let chance = if i.is_multiple_of(4) { 0.1 } else { 0.5 };
                let samples = 64.0;
                let hits = (0..64).filter(|_| rng.next_f64() < chance).count() as f64 / samples;
                let value = factor * (f64::from(i) * 0.3).sin() + hits / chance - 1.0;
                let error = (hits * (1.0 - hits) / (samples - 1.0)).sqrt() / chance;
                Estimate { mean: Rgb::splat(value), stderr: Rgb::splat(error) }
            };
            (0..64).map(&mut block).collect()
        };
        let [first, second] = [half(), half()];
        let both = |(a, b): (&Estimate, &Estimate)| Estimate {
            mean: (a.mean + b.mean) * 0.5,
            stderr: (a.stderr * a.stderr + b.stderr * b.stderr).map(|v| 0.5 * v.sqrt()),
        };
        let all = first.iter().zip(&second).map(both).collect();
        [first, all].map(|blocks: Vec<Estimate>| Layer {
            size: [16, 16],
            pixels: Vec::new(),
            total: blocks[0],
            tail: Tail::default(),
            blocks,
        })
    }

    /// Mean of what an image that is a factor times another is said to be larger by than that other, which is known but
    /// for the error of a step, and the standard error in the mean; both in standard errors.
    fn against_known(factor: f64) -> [f64; 2] {
        let mut rng = Rng::new(6, 0, 0);
        let mut sums = [0.0; 2];
        for _ in 0..TRIALS {
            let [first, all] = measured(factor, &mut rng);
            let with = |of: &dyn Fn(usize) -> f64, stderr: f64| {
                let mut layer = all.clone();
                for (i, block) in layer.blocks.iter_mut().enumerate() {
                    *block = Estimate { mean: Rgb::splat(of(i)), stderr: Rgb::splat(stderr) };
                }
                layer
            };
            let exact = |i: usize| (f64::from(i as u32) * 0.3).sin();
            let change = |i: usize| 3e-3 * exact(i);
            let known = with(&|i| exact(i) + change(i) / 3.0, 1e-4);
            let halves = Halves { first: &first, all: &all };
            let scale = Scale::against(halves, &known, &with(&change, 0.0));
            let z = scale.off / scale.stderr;
            [z, scale.stderr].iter().zip(&mut sums).for_each(|(x, sum)| *sum += x);
        }
        sums.map(|s| s / TRIALS as f64)
    }

    #[test]
    fn finite_differences_are_corrected_for_their_steps() {
        let [mean, stderr] = against_known(1.0);
        assert!(mean.abs() < 4.0 / (TRIALS as f64).sqrt(), "{mean}");
        // Planted: a factor is off by five standard errors.
        let [mean, _] = against_known(1.0 + 5.0 * stderr);
        assert!((4.0..6.0).contains(&mean), "{mean}");
    }

    /// Mean and rms, in standard errors, of what an image that is a factor times another is said to be
    /// larger by; and the standard error in the mean.
    fn said(factor: f64) -> [f64; 3] {
        let mut rng = Rng::new(5, 0, 0);
        let mut sums = [0.0; 3];
        for _ in 0..TRIALS {
            let [a, b] = [factor, 1.0].map(|f| measured(f, &mut rng));
            let [a, b] = [&a, &b].map(|[first, all]| Halves { first, all });
            let scale = Scale::new(a, b);
            let z = scale.off / scale.stderr;
            [z, z * z, scale.stderr].iter().zip(&mut sums).for_each(|(x, sum)| *sum += x);
        }
        let [z, squares, stderr] = sums.map(|s| s / TRIALS as f64);
        [z, squares.sqrt(), stderr]
    }

    #[test]
    fn deviations_are_as_large_as_is_said() {
        let [mean, rms, stderr] = said(1.0);
        assert!(
            mean.abs() < 4.0 / (TRIALS as f64).sqrt() && (0.9..1.1).contains(&rms),
            "{mean} {rms}"
        );
        // Planted: a factor is off by five standard errors.
        let [mean, ..] = said(1.0 + 5.0 * stderr);
        assert!((4.0..6.0).contains(&mean), "{mean}");
    }
}
