use drt_math::fm;

use super::OptimizeError;

/// How far and where one number may move.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Variable {
    /// The learning rate: of the value, or of its logarithm. 0 keeps the value.
    pub learning_rate: f64,
    /// The least value.
    pub lower: f64,
    /// The largest value.
    pub upper: f64,
    /// Steps change the logarithm of the value, which must be positive and stays so: for densities,
    /// roughnesses and sizes, whose ratios matter.
    pub logarithmic: bool,
}

impl Default for Variable {
    /// A learning rate of 0.01 and no bounds.
    fn default() -> Self {
        Self {
            learning_rate: 0.01,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            logarithmic: false,
        }
    }
}

impl Variable {
    pub(super) fn check(&self, variable: usize, start: f64) -> Result<(), OptimizeError> {
        let Self { learning_rate, lower, upper, .. } = *self;
        if !start.is_finite() {
            return Err(OptimizeError::NotFinite { variable, what: "its start" });
        }
        if !(learning_rate >= 0.0 && learning_rate.is_finite()) {
            return Err(OptimizeError::LearningRate { variable, value: learning_rate });
        }
        if lower.is_nan() || upper.is_nan() || lower >= upper {
            return Err(OptimizeError::Bounds { variable, lower, upper });
        }
        if !(lower..=upper).contains(&start) {
            return Err(OptimizeError::Start { variable, value: start, lower, upper });
        }
        if self.logarithmic && start <= 0.0 {
            return Err(OptimizeError::NotPositive { variable, value: start });
        }
        Ok(())
    }

    /// What steps are added to.
    pub(super) fn coordinate(&self, value: f64) -> f64 {
        if self.logarithmic { fm::ln(value) } else { value }
    }

    /// The inverse of [`coordinate`](Self::coordinate), within the bounds.
    pub(super) fn value(&self, coordinate: f64) -> f64 {
        let value = if self.logarithmic { fm::exp(coordinate) } else { coordinate };
        value.clamp(self.lower, self.upper)
    }

    /// The derivative of the value by the coordinate.
    pub(super) fn slope(&self, value: f64) -> f64 {
        if self.logarithmic { value } else { 1.0 }
    }

    /// How far the coordinate may move from that of `value`, by at most `rate` and within the bounds.
    pub(super) fn limits(&self, value: f64, rate: f64) -> [f64; 2] {
        let from = self.coordinate(value);
        // Bounds that are not positive do not limit a logarithm from below.
        let low = if self.logarithmic && self.lower <= 0.0 {
            f64::NEG_INFINITY
        } else {
            self.coordinate(self.lower)
        };
        let high = self.coordinate(self.upper);
        [(low - from).clamp(-rate, 0.0), (high - from).clamp(0.0, rate)]
    }
}
