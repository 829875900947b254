use alloc::vec;

#[cfg(feature = "sparse")]
use super::LaplacianSmoothing;
use crate::optimize::{Method, OptimizeError, Stages, Variable};

/// How a field steps.
#[derive(Clone, Debug)]
pub struct FieldRule {
    /// The method, which is [`Method::Adam`] or [`Method::Momentum`]. Gauss-Newton steps would need a matrix of
    /// all unknowns and are refused.
    pub method: Method,
    /// The learning rate of each iteration, 0 or positive: of the values, or of their logarithms. In an iteration
    /// whose learning rate is 0 the values stay, while the method still learns from the gradient.
    pub learning_rate: Stages<f64>,
    /// The least that a value may be; minus infinity where there is no such bound.
    pub lower: f64,
    /// The most that a value may be; infinity where there is no such bound.
    pub upper: f64,
    /// True where steps change the logarithms of the values, which must be positive and stay so, as with
    /// [`Variable::logarithmic`](crate::optimize::Variable::logarithmic). Gradients are still those by the values.
    pub logarithmic: bool,
    /// What makes the steps of a mesh's vertices smooth; `None` where every value steps by itself. A smoothed
    /// field takes neither bounds nor logarithms.
    #[cfg(feature = "sparse")]
    pub smoothing: Option<LaplacianSmoothing>,
}

impl Default for FieldRule {
    /// Adam with a learning rate of 0.01 throughout, without bounds, logarithms and smoothing.
    fn default() -> Self {
        let Variable { learning_rate, lower, upper, logarithmic } = Variable::default();
        Self {
            method: Method::ADAM,
            learning_rate: Stages::new(learning_rate, vec![]),
            lower,
            upper,
            logarithmic,
            #[cfg(feature = "sparse")]
            smoothing: None,
        }
    }
}

impl FieldRule {
    /// Whether the rule can be followed by a field of these values.
    pub(super) fn check(&self, values: &[f64]) -> Result<(), OptimizeError> {
        self.method.check()?;
        if matches!(self.method, Method::GaussNewton { .. }) {
            return Err(OptimizeError::FieldMethod);
        }
        if let Some(value) = self.learning_rate.values().find(|r| !(*r >= 0.0 && r.is_finite())) {
            let expected = "0 or a positive number";
            return Err(OptimizeError::Method { name: "the learning rate", value, expected });
        }
        #[cfg(feature = "sparse")]
        if let Some(smoothing) = &self.smoothing {
            let bounded = self.lower != f64::NEG_INFINITY || self.upper != f64::INFINITY;
            if bounded || self.logarithmic {
                return Err(OptimizeError::SmoothedBounds);
            }
            smoothing.laplacian().columns(values.len())?;
        }
        let variable = self.variable();
        values.iter().enumerate().try_for_each(|(i, value)| variable.check(i, *value))
    }

    /// The rule of every single value, but for the learning rate.
    pub(super) fn variable(&self) -> Variable {
        let Self { lower, upper, logarithmic, .. } = *self;
        Variable { learning_rate: 0.0, lower, upper, logarithmic }
    }
}
