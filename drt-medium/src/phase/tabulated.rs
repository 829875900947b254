use alloc::vec::Vec;
use core::f64::consts::PI;

use drt_math::{Real, fm};

use crate::MediumError;

/// A phase function that is linear in the cosine between equally spaced ones, from -1 to 1.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "Vec<f64>", try_from = "Vec<f64>"))]
pub struct PhaseTable {
    /// Densities over the cosine, whose integral is one.
    densities: Vec<f64>,
    /// Probability of all cosines below each.
    below: Vec<f64>,
}

impl PhaseTable {
    /// From values at equally spaced cosines of the flow, from -1 (straight back) to 1, given up to a factor.
    ///
    /// # Errors
    /// When there are fewer than two, or one is negative or not finite, or all are zero.
    pub fn new(mut values: Vec<f64>) -> Result<Self, MediumError> {
        let wrong = |what, value, expected| MediumError::PhaseFunction { what, value, expected };
        if let Some(&value) = values.iter().find(|v| !(**v >= 0.0 && v.is_finite())) {
            return Err(wrong("value", value, "finite and not negative"));
        }
        if values.len() < 2 {
            return Err(wrong("number of values", values.len() as f64, "2 or more"));
        }
        let largest = values.iter().copied().fold(0.0, f64::max);
        if largest == 0.0 {
            return Err(wrong("largest value", 0.0, "above zero"));
        }
        let width = 2.0 / (values.len() - 1) as f64;
        for v in &mut values {
            *v /= largest;
        }
        let total: f64 = values.windows(2).map(|k| 0.5 * (k[0] + k[1]) * width).sum();
        let (mut below, mut sum) = (Vec::with_capacity(values.len()), 0.0);
        for v in &mut values {
            *v /= total;
        }
        below.push(0.0);
        for k in values.windows(2) {
            sum += 0.5 * (k[0] + k[1]) * width;
            below.push(sum);
        }
        // Rounding must not leave a number below one beyond the last cosine.
        let last = below.len() - 1;
        below[last] = 1.0;
        Ok(Self { densities: values, below })
    }

    /// Mean cosine of the flow.
    #[must_use]
    pub fn mean_cosine(&self) -> f64 {
        let width = self.width();
        let part = |(i, k): (usize, &[f64])| {
            let from = i as f64 * width - 1.0;
            let mean = 0.5 * (k[0] + k[1]);
            // Of a straight line times the cosine.
            width * (mean * (from + 0.5 * width) + (k[1] - k[0]) * width / 12.0)
        };
        self.densities.windows(2).enumerate().map(part).sum()
    }

    fn width(&self) -> f64 {
        2.0 / (self.densities.len() - 1) as f64
    }

    /// The first end of the piece with a cosine, and the densities at both.
    fn piece(&self, c: f64) -> (f64, [f64; 2]) {
        let width = self.width();
        // Casts saturate.
        let i = (((c + 1.0) / width) as usize).min(self.densities.len() - 2);
        (i as f64 * width - 1.0, [self.densities[i], self.densities[i + 1]])
    }

    pub(super) fn eval<T: Real>(&self, c: T) -> T {
        let (from, [a, b]) = self.piece(c.re());
        ((c - from) * ((b - a) / self.width()) + a) * (0.5 / PI)
    }

    pub(super) fn d_cos(&self, c: f64) -> f64 {
        let (_, [a, b]) = self.piece(c);
        (b - a) / self.width() * (0.5 / PI)
    }

    /// The cosine below which a fraction `u` of the light goes.
    pub(super) fn sample_cosine(&self, u: f64) -> f64 {
        let last = self.densities.len() - 2;
        let i = (self.below.partition_point(|&p| p <= u) - 1).min(last);
        let (a, b) = (self.densities[i], self.densities[i + 1]);
        let v = f64::min((u - self.below[i]) / (self.below[i + 1] - self.below[i]), 1.0);
        // The root of a t + (b - a) t²/2 = v (a + b)/2, in the form without cancellation.
        let t = v * (a + b) / (a + fm::sqrt(f64::max(a * a + v * (b * b - a * a), 0.0)));
        let c = (i as f64 + t) * self.width() - 1.0;
        c.clamp(-1.0, 1.0)
    }
}

impl From<PhaseTable> for Vec<f64> {
    fn from(table: PhaseTable) -> Self {
        table.densities
    }
}

impl TryFrom<Vec<f64>> for PhaseTable {
    type Error = MediumError;
    fn try_from(values: Vec<f64>) -> Result<Self, MediumError> {
        Self::new(values)
    }
}
