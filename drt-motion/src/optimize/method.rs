use drt_math::fm;

use super::OptimizeError;

/// How a step follows from the gradients so far.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Method {
    /// Kingma and Ba 2015, "Adam: a method for stochastic optimization", algorithm 1: steps of about the
    /// learning rate, whatever the gradient's scale.
    Adam {
        /// Decay of the mean gradient.
        beta1: f64,
        /// Decay of the mean squared gradient.
        beta2: f64,
        /// Added to the root mean square. In units of the gradient: far below what matters, or dim
        /// scenes stand still.
        epsilon: f64,
    },
    /// Polyak's heavy ball: v becomes momentum · v + g, and the step is the learning rate times v.
    Momentum {
        /// What remains of the previous step; 0 is plain gradient descent.
        momentum: f64,
    },
}

impl Method {
    /// Adam with the decays of its paper, and an epsilon that matters for vanishing gradients only.
    pub const ADAM: Self = Self::Adam { beta1: 0.9, beta2: 0.999, epsilon: 1e-15 };

    pub(super) fn check(&self) -> Result<(), OptimizeError> {
        let decay = |name, value: f64| {
            let expected = "a number from 0 to less than 1";
            let fits = (0.0..1.0).contains(&value);
            if fits { Ok(()) } else { Err(OptimizeError::Method { name, value, expected }) }
        };
        match *self {
            Self::Adam { beta1, beta2, epsilon } => {
                decay("beta1", beta1)?;
                decay("beta2", beta2)?;
                if epsilon > 0.0 && epsilon.is_finite() {
                    return Ok(());
                }
                let expected = "a positive number";
                Err(OptimizeError::Method { name: "epsilon", value: epsilon, expected })
            }
            Self::Momentum { momentum } => decay("momentum", momentum),
        }
    }

    /// Takes gradient `g` into the moments of one variable; the step for a learning rate of 1.
    /// `unseen` is β1ᵗ and β2ᵗ after this, the t-th gradient: what the moments still hold of the zeros
    /// that they began as.
    pub(super) fn step(&self, g: f64, first: &mut f64, second: &mut f64, unseen: [f64; 2]) -> f64 {
        match *self {
            Self::Adam { beta1, beta2, epsilon } => {
                *first = beta1 * *first + (1.0 - beta1) * g;
                *second = beta2 * *second + (1.0 - beta2) * g * g;
                let mean = *first / (1.0 - unseen[0]);
                let square = *second / (1.0 - unseen[1]);
                mean / (fm::sqrt(square) + epsilon)
            }
            Self::Momentum { momentum } => {
                *first = momentum * *first + g;
                *first
            }
        }
    }

    /// The decays of the two moments.
    pub(super) fn decays(&self) -> [f64; 2] {
        match *self {
            Self::Adam { beta1, beta2, .. } => [beta1, beta2],
            Self::Momentum { .. } => [0.0; 2],
        }
    }
}
