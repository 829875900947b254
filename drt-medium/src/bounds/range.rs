//! Bounds and the mean of a field over a part of space.

use drt_math::Rgb;

use crate::Piece;
use crate::tracking::zip;

/// Expected null collisions on a way through a fine cell beyond which it is cut up: about what that costs.
const LOOSE: f64 = 64.0;
/// Expected null collisions on a way through a coarse cell up to which it is not worth while to look at the fine ones.
const TIGHT: f64 = 0.5;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub(super) min: Rgb,
    /// The largest magnitude.
    pub(super) max: Rgb,
    pub(super) mean: Rgb,
}

impl Range {
    /// A range from the least value, the largest magnitude and the mean of each channel.
    #[inline(always)]
    pub(super) fn by_channel([r, g, b]: [[f64; 3]; 3]) -> Self {
        let number = |k: usize| Rgb::new(r[k], g[k], b[k]);
        Self { min: number(0), max: number(1), mean: number(2) }
    }

    /// This is the least value, the largest magnitude and the mean of some numbers.
    pub(super) fn of_numbers(numbers: impl Iterator<Item = f64>) -> [f64; 3] {
        let (mut min, mut max, mut sum, mut count) = (f64::INFINITY, 0.0, 0.0, 0.0);
        // Nested iterators are fast from inside only.
        numbers.for_each(|v| {
            min = f64::min(min, v);
            max = f64::max(max, v.abs());
            sum += v;
            count += 1.0;
        });
        [min, max, sum / count]
    }

    pub(super) fn of(values: impl Iterator<Item = Rgb>) -> Self {
        Self::around(values.map(|v| Self { min: v, max: v.abs(), mean: v }))
    }

    /// Bounds of several parts of space together, whose means count alike.
    pub(super) fn around(parts: impl Iterator<Item = Self>) -> Self {
        let (mut min, mut max) = (Rgb::splat(f64::INFINITY), Rgb::ZERO);
        let (mut sum, mut count) = (Rgb::ZERO, 0.0);
        // Nested iterators are fast from inside only.
        parts.for_each(|part| {
            min = zip(min, part.min, f64::min);
            max = zip(max, part.max, f64::max);
            sum += part.mean;
            count += 1.0;
        });
        Self { min, max, mean: sum / count }
    }

    /// The null collisions that are expected on a piece of a ray, at most.
    #[inline(always)]
    fn null_collisions(&self, scale: f64, [start, end]: [f64; 2]) -> f64 {
        (self.max - self.min).max_channel() * scale * (end - start)
    }

    #[inline(always)]
    pub(super) fn is_loose(&self, scale: f64, part: [f64; 2]) -> bool {
        self.null_collisions(scale, part) > LOOSE
    }

    #[inline(always)]
    pub(super) fn is_tight(&self, scale: f64, part: [f64; 2]) -> bool {
        self.null_collisions(scale, part) <= TIGHT
    }

    /// The range widened by what rounding may add to interpolated values, and cut to the range `o` of the voxels that
    /// they lie between.
    pub(super) fn within(self, o: &Self) -> Self {
        const ROUNDING: f64 = 1e-12;
        let min = zip(self.min * (1.0 - ROUNDING), o.min, f64::max);
        let max = zip(self.max * (1.0 + ROUNDING), o.max, f64::min);
        Self { min, max, mean: self.mean }
    }

    /// A negative scale cannot occur: media check it.
    #[inline(always)]
    pub(super) fn piece(&self, scale: f64, [start, end]: [f64; 2]) -> Piece {
        Piece {
            start,
            end,
            majorant: self.max * scale,
            minorant: self.min * scale,
            mean: self.mean * scale,
        }
    }
}
