use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Real, fm};

use crate::model::filter::{Filter, FilterKind, ON_BORDER};

/// The factors p of one axis for neighbouring pixels, from left to right, and their derivatives by the offset. It never ends. Where the
/// filter jumps, the factor is the mean of both sides.
///
/// A Gaussian's g(x) takes no exponential for each: g(x - 1) = g(x) r(x) with r(x) = exp((2x - 1) / 2σ²), and
/// r(x - 1) = r(x) exp(-1/σ²). Rounding adds up to 10⁻¹¹ of a value over the widest filter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilterRow<'a> {
    filter: &'a Filter,
    /// Of the next pixel.
    offset: f64,
    /// A Gaussian's value there, in units of that at the radius, and the ratio of the one after to it.
    bell: f64,
    ratio: f64,
}

impl Filter {
    /// Of a point at the coordinate `at`, from the pixel `first` on.
    #[inline]
    pub(crate) fn row(&self, at: f64, first: u32) -> FilterRow<'_> {
        let offset = at - (f64::from(first) + 0.5);
        let (bell, ratio) = match self.kind {
            FilterKind::Gaussian { radius, std_dev } => {
                let inv = 0.5 / (std_dev * std_dev);
                (
                    fm::exp((radius - offset) * (radius + offset) * inv),
                    fm::exp((2.0 * offset - 1.0) * inv),
                )
            }
            _ => (0.0, 0.0),
        };
        FilterRow { filter: self, offset, bell, ratio }
    }
}

impl Filter {
    /// Fills in the factors p of one axis for the pixels `reached`, those whose supports hold the coordinate `at`. Returns the density
    /// there of the [samples](Filter::sample) of these pixels together, as they are drawn where derivatives are wanted or not; without
    /// either, 1.
    pub(crate) fn weights(
        &self,
        at: f64,
        reached: Range<u32>,
        sampled: Option<bool>,
        weights: &mut Vec<f64>,
    ) -> f64 {
        weights.clear();
        weights.resize(reached.len(), 0.0);
        let density = sampled.map(|derivative| {
            let share = self.slope_share(derivative);
            [1.0 - share, 0.5 * share / self.peak]
        });
        let (scale, start) = (self.scale, at - (f64::from(reached.start) + 0.5));
        match self.kind {
            FilterKind::Box { .. } => self.fill(start, density, weights, |_| [scale, scale, 0.0]),
            FilterKind::Tent { radius } => self.fill(start, density, weights, |x| {
                let p = scale * (1.0 - Real::abs(x) / radius);
                [p, p, scale / radius]
            }),
            FilterKind::Gaussian { radius, std_dev } => {
                let mut row = self.row(at, reached.start);
                let (even, knots) = (0.5 / radius, self.half.segments() / radius);
                let slope = scale / (std_dev * std_dev);
                self.fill(start, density, weights, |x| {
                    let (x, bell) = (Real::abs(x), row.bell);
                    row.step();
                    [scale * (bell - 1.0), even * self.half.pdf_at(x * knots), x * slope * bell]
                })
            }
            // Their slopes are in their densities.
            FilterKind::Mitchell { .. } | FilterKind::Lanczos { .. } => {
                let (even, knots) = (0.5 / self.radius, self.half.segments() / self.radius);
                self.fill(start, density, weights, |x| {
                    [self.axis(x), even * self.half.pdf_at(Real::abs(x) * knots), 0.0]
                })
            }
        }
    }

    /// Fills in what `factors` says of offsets: p, the density close to it, and the steepness |p'|.
    #[inline(always)]
    fn fill(
        &self,
        mut offset: f64,
        density: Option<[f64; 2]>,
        weights: &mut [f64],
        mut factors: impl FnMut(f64) -> [f64; 3],
    ) -> f64 {
        let (sampled, [even, steep]) = (density.is_some(), density.unwrap_or_default());
        let mut sum = 0.0;
        for weight in weights {
            let [p, profile, slope] = factors(offset);
            if -self.radius <= offset && offset < self.radius {
                *weight = p;
                sum += even * profile + steep * slope;
            }
            offset -= 1.0;
        }
        if sampled { sum } else { 1.0 }
    }
}

impl FilterRow<'_> {
    fn step(&mut self) {
        self.offset -= 1.0;
        self.bell *= self.ratio;
        self.ratio *= self.filter.decay;
    }
}

impl Iterator for FilterRow<'_> {
    type Item = (f64, f64);

    #[inline]
    fn next(&mut self) -> Option<(f64, f64)> {
        let filter = self.filter;
        let factors = match filter.kind {
            FilterKind::Gaussian { .. } => filter.with_slope(self.offset, self.bell - 1.0),
            FilterKind::Box { radius } => {
                // An edge along a border, as in symmetric scenes, counts half for either pixel: what central differences tend to.
                let beyond = Real::abs(self.offset) - radius;
                let share = if Real::abs(beyond) < ON_BORDER { 0.5 } else { 1.0 };
                (if beyond < ON_BORDER { share * filter.scale } else { 0.0 }, 0.0)
            }
            _ => filter.axis_with_slope(self.offset),
        };
        self.step();
        Some(factors)
    }
}
