//! Drawing image points in proportion to a filter.

use alloc::vec::Vec;

use drt_math::{Real, fm};

use crate::model::filter::{Filter, FilterKind, shape_inverse};

/// Share of samples drawn in proportion to |p'| where the derivative is wanted too.
///
/// With a pdf proportional to p alone, E[(p'/p)²] is infinite for every filter that ends without
/// a jump (`theory` §14.4). For a tent, a quarter raises the second moment of the value by 3 %
/// and leaves that of the derivative 30 % above its minimum.
const SLOPE_SHARE: f64 = 0.25;

/// An image point drawn for a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// Image point minus pixel centre, in pixels.
    pub offset: [f64; 2],
    /// P over the density: the factor on whatever is found at the image point.
    pub weight: f64,
    /// Gradient of P by the offset, over the density.
    pub slope: [f64; 2],
    /// Density per square pixel.
    pub pdf: f64,
}

impl Filter {
    /// Draws an image point from two uniform numbers in [0, 1).
    ///
    /// `derivative` mixes in samples that keep the variance of the filter's gradient finite.
    /// Without it the weight is 1 (a Gaussian's: within a few per mille where the filter matters).
    /// Mirrored numbers, 1 - u, give mirrored offsets, for antithetic pairs.
    #[inline]
    #[must_use]
    pub fn sample(&self, u: [f64; 2], derivative: bool) -> FilterSample {
        let offset = u.map(|u| self.sample_axis(u, derivative));
        let share = self.slope_share(derivative);
        let [(x, sx), (y, sy)] = offset.map(|o| self.axis_with_slope(o));
        let pdf = self.pdf_axis(offset[0], x, sx, share) * self.pdf_axis(offset[1], y, sy, share);
        let slope = [sx * y, x * sy].map(|g| g / pdf);
        FilterSample { offset, weight: x * y / pdf, slope, pdf }
    }

    /// Density of [`sample`](Self::sample) at an offset, per square pixel.
    #[inline]
    #[must_use]
    pub fn pdf(&self, offset: [f64; 2], derivative: bool) -> f64 {
        let share = self.slope_share(derivative);
        let pdf = |x| {
            let (p, slope) = self.axis_with_slope(x);
            self.pdf_axis(x, p, slope, share)
        };
        offset.map(pdf).iter().product()
    }

    /// Draws a coordinate evenly from the unit interval of pixel `i` out of a row of `n`; with its density. What
    /// filters see before the first interval is drawn along with it, in proportion to the first pixel's filter: no
    /// other counts for more there. So it is behind the last one.
    pub(crate) fn sample_interval(&self, i: u32, n: u32, u: f64) -> (f64, f64) {
        let ends = [i == 0, i + 1 == n];
        if !ends[0] && !ends[1] {
            return (f64::from(i) + u, 1.0);
        }
        let (tail, part) = self.beyond();
        let [before, behind] = ends.map(|end| if end { part } else { 0.0 });
        let inside = 1.0 - before - behind;
        // Half a pixel or more from the centre; `v` is 0 at the end of the filter, 1 where the interval begins.
        let outside = |v: f64| {
            // The last representable number would give the offset where the density is zero.
            let below = f64::min(1.0 - 2.0 * tail * v, 1.0 - f64::EPSILON);
            let x = self.radius * self.half.sample(below);
            (x, self.pdf_axis(-x, self.axis(-x), 0.0, 0.0) * part / tail)
        };
        let [start, centre] = [f64::from(i), f64::from(i) + 0.5];
        if u < before {
            let (x, pdf) = outside(u / part);
            (centre - x, pdf)
        } else if u < before + inside {
            (start + (u - before) / inside, inside)
        } else {
            let (x, pdf) = outside((1.0 - u) / part);
            (centre + x, pdf)
        }
    }

    /// Of the filter's samples, the part that is farther than half a pixel to one side; and the part of those of an
    /// interval at an end of a row that goes there: of the former and the interval together, rounded to a power of
    /// two, as points of a Sobol' sequence are shared out evenly then.
    fn beyond(&self) -> (f64, f64) {
        let edge = 0.5 / self.radius;
        if edge >= 1.0 {
            return (0.0, 0.0);
        }
        let tail = 0.5 * (1.0 - self.half.distribution(edge));
        let mut part = 0.25;
        while 0.75 * part * (1.0 + tail) > tail {
            part *= 0.5;
        }
        (tail, part)
    }

    /// A constant profile has no slope to sample.
    pub(super) fn slope_share(&self, derivative: bool) -> f64 {
        match self.kind {
            // Of signed ones the slope is in the density at all times.
            FilterKind::Box { .. } | FilterKind::Mitchell { .. } | FilterKind::Lanczos { .. } => {
                0.0
            }
            _ if derivative => SLOPE_SHARE,
            _ => 0.0,
        }
    }

    fn sample_axis(&self, u: f64, derivative: bool) -> f64 {
        let share = self.slope_share(derivative);
        // The last representable number would give the offset where the density is zero.
        let v = f64::min(Real::abs(2.0 * u - 1.0), 1.0 - f64::EPSILON);
        let x = if v < share {
            shape_inverse(self.kind, 1.0 - v / share)
        } else {
            self.radius * self.half.sample((v - share) / (1.0 - share))
        };
        if u < 0.5 { -x } else { x }
    }

    fn pdf_axis(&self, x: f64, p: f64, slope: f64, share: f64) -> f64 {
        let profile = match self.kind {
            // Of which samples are in proportion to p.
            FilterKind::Box { .. } | FilterKind::Tent { .. } => p,
            _ if -self.radius <= x && x < self.radius => {
                0.5 / self.radius * self.half.pdf(Real::abs(x) / self.radius)
            }
            _ => return 0.0,
        };
        if share == 0.0 {
            return profile;
        }
        profile * (1.0 - share) + Real::abs(slope) * (share / (2.0 * self.peak))
    }
}

/// A density on [0, 1], linear between equally spaced knots.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HalfProfile {
    /// Densities at the knots.
    knots: Vec<f64>,
    /// Probability of everything before each knot.
    cumulative: Vec<f64>,
}

impl HalfProfile {
    /// Interpolates a nonnegative function, positive at 0, given up to a factor.
    pub(super) fn new(segments: usize, f: impl Fn(f64) -> f64) -> Self {
        let n = segments as f64;
        let mut knots: Vec<f64> = (0..=segments).map(|i| f(i as f64 / n)).collect();
        let total: f64 = knots.windows(2).map(|k| 0.5 * (k[0] + k[1]) / n).sum();
        for k in &mut knots {
            *k /= total;
        }
        let mut before = 0.0;
        let mut cumulative = Vec::with_capacity(segments + 1);
        cumulative.push(0.0);
        for k in knots.windows(2) {
            before += 0.5 * (k[0] + k[1]) / n;
            cumulative.push(before);
        }
        // Rounding must not leave a number below one beyond the last knot.
        cumulative[segments] = 1.0;
        Self { knots, cumulative }
    }

    /// Inverts the distribution function; `u` in [0, 1).
    fn sample(&self, u: f64) -> f64 {
        let last = self.knots.len() - 2;
        let i = (self.cumulative.partition_point(|&c| c <= u) - 1).min(last);
        let (a, b) = (self.knots[i], self.knots[i + 1]);
        let (below, above) = (self.cumulative[i], self.cumulative[i + 1]);
        let v = f64::min((u - below) / (above - below), 1.0);
        // The root of a t + (b - a) t²/2 = v (a + b)/2, in the form without cancellation.
        let t = v * (a + b) / (a + fm::sqrt(f64::max(a * a + v * (b * b - a * a), 0.0)));
        (i as f64 + t) / (last + 1) as f64
    }

    /// How many segments there are.
    pub(super) fn segments(&self) -> f64 {
        (self.knots.len() - 1) as f64
    }

    /// The probability of everything before `x`.
    fn distribution(&self, x: f64) -> f64 {
        let n = (self.knots.len() - 1) as f64;
        let i = ((x * n) as usize).min(self.knots.len() - 2);
        let t = x * n - i as f64;
        self.cumulative[i] + 0.5 * t * (self.knots[i] + self.pdf(x)) / n
    }

    fn pdf(&self, x: f64) -> f64 {
        self.pdf_at(x * (self.knots.len() - 1) as f64)
    }

    /// At a number of knots from the start.
    #[inline]
    pub(super) fn pdf_at(&self, at: f64) -> f64 {
        let last = self.knots.len() - 2;
        let i = (at as u32 as usize).min(last);
        let t = at - i as f64;
        self.knots[i] + (self.knots[i + 1] - self.knots[i]) * t
    }
}
