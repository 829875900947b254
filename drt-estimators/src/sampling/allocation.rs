//! Which pixels take more samples than others.
//!
//! Where n_i samples of the variance σ_i² go to pixel i, the mean of all pixels' variances is (1/N) Σ σ_i² / n_i. With
//! Σ n_i given it is least for n_i in proportion to σ_i (Neyman 1934, "On the Two Different Aspects of the
//! Representative Method"), and then (mean σ)² / mean σ² of that with equal n_i: a derivative is often noisy
//! in few pixels.
//!
//! The σ are those of a pilot, few samples of each pixel which are then forgotten: a sample must not decide
//! how much it counts. They are noisy themselves, so they are averaged over neighbours, and every pixel
//! takes a part [`EQUAL`] of what it would among equals. Several derivatives count alike: each by its variance over the
//! mean of that.

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use drt_math::Real;

use crate::sampling::film::PixelFilm;

/// The part of the samples that is shared out equally.
const EQUAL: f64 = 0.33;

/// How many times the mean a pixel takes at most.
pub(crate) const MOST: u32 = 16;

/// Neighbours on each side over which noise is averaged.
const AROUND: u32 = 2;

/// A pilot's part of the samples, and its fewest and most.
const PILOT: (u32, u32, u32) = (8, 4, 32);

/// Samples of the pixels, over their mean.
#[derive(Clone, Debug)]
pub(crate) struct Allocation {
    shares: Vec<f32>,
}

/// Samples of the pilot, when each pixel is to have `units`; none if they are too few.
pub(crate) fn pilot(units: u32) -> Option<u32> {
    let (part, fewest, most) = PILOT;
    (units >= 2 * fewest).then(|| (units / part).clamp(fewest, most))
}

impl Allocation {
    /// By the noise that a pilot has seen; each of `counted` is the layers of one derivative, with how much
    /// the variance of each counts.
    pub(crate) fn new(pilot: &PixelFilm, counted: impl Iterator<Item = Vec<(usize, f64)>>) -> Self {
        let size = pilot.size();
        let n = (size[0] * size[1]) as usize;
        let mut sum = alloc::vec![0.0; n];
        for layers in counted {
            let of_pixel = |i: u32| {
                let variance: f64 = layers.iter().map(|(l, c)| c * pilot.variance(i, *l)).sum();
                Real::sqrt(variance)
            };
            let noise: Vec<f64> = smooth(size, (0..n as u32).map(of_pixel).collect());
            let mean = noise.iter().sum::<f64>() / n as f64;
            if mean > 0.0 && mean.is_finite() {
                sum.iter_mut().zip(&noise).for_each(|(s, v)| *s += (v / mean) * (v / mean));
            }
        }
        let noise: Vec<f64> = sum.into_iter().map(Real::sqrt).collect();
        let mean = noise.iter().sum::<f64>() / n as f64;
        let share = |v: &f64| {
            let own = if mean > 0.0 { v / mean } else { 1.0 };
            f64::min(EQUAL + (1.0 - EQUAL) * own, f64::from(MOST)) as f32
        };
        Self { shares: noise.iter().map(share).collect() }
    }

    /// Samples of a pixel where the mean is `given`; at least one.
    pub(crate) fn taken(&self, pixel: u32, given: u32) -> u32 {
        let share = self.shares.get(pixel as usize).map_or(1.0, |s| f64::from(*s));
        let taken = (f64::from(given) * share + 0.5) as u32;
        taken.clamp(1, given.saturating_mul(MOST))
    }
}

/// Means over squares of pixels.
fn smooth([w, h]: [u32; 2], values: Vec<f64>) -> Vec<f64> {
    let around = |i: u32, n: u32| i.saturating_sub(AROUND)..u32::min(i + AROUND + 1, n);
    let rows = |x: u32, y: u32| around(x, w).map(move |x| (y * w + x) as usize);
    let columns = |x: u32, y: u32| around(y, h).map(move |y| (y * w + x) as usize);
    let mean = |values: &[f64], at: &mut dyn Iterator<Item = usize>| {
        let (mut sum, mut count) = (0.0, 0.0);
        for i in at {
            sum += values[i];
            count += 1.0;
        }
        sum / count
    };
    let pixels = || (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
    let along: Vec<f64> = pixels().map(|(x, y)| mean(&values, &mut rows(x, y))).collect();
    pixels().map(|(x, y)| mean(&along, &mut columns(x, y))).collect()
}
