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
    /// Gauss and Newton's steps by averaged gradients and matrices, for sums of squares: see
    /// [`Observation`](super::Observation). The learning rate is the longest step.
    GaussNewton {
        /// The part of the run so far that the averages span: 1 is all of it, and less forgets sooner
        /// what was seen far from the goal.
        memory: f64,
    },
}

impl Method {
    /// Gauss and Newton's with averages over the last third of the way, about.
    pub const GAUSS_NEWTON: Self = Self::GaussNewton { memory: 0.35 };

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
            Self::GaussNewton { memory } if memory > 0.0 && memory <= 1.0 => Ok(()),
            Self::GaussNewton { memory } => {
                let expected = "more than 0 and at most 1";
                Err(OptimizeError::Method { name: "memory", value: memory, expected })
            }
        }
    }

    /// Takes gradient `g` into the moments of one variable; the step for a learning rate of 1.
    /// `unseen` is β1ᵗ and β2ᵗ after this, the t-th gradient: what the moments still hold of the zeros
    /// that they began as. `None` where steps need more than gradients.
    pub(super) fn step(
        &self,
        g: f64,
        first: &mut f64,
        second: &mut f64,
        unseen: [f64; 2],
    ) -> Option<f64> {
        match *self {
            Self::Adam { beta1, beta2, epsilon } => {
                *first = beta1 * *first + (1.0 - beta1) * g;
                *second = beta2 * *second + (1.0 - beta2) * g * g;
                let mean = *first / (1.0 - unseen[0]);
                let square = *second / (1.0 - unseen[1]);
                Some(mean / (fm::sqrt(square) + epsilon))
            }
            Self::Momentum { momentum } => {
                *first = momentum * *first + g;
                Some(*first)
            }
            Self::GaussNewton { .. } => None,
        }
    }

    /// The decays of the two moments.
    pub(super) fn decays(&self) -> [f64; 2] {
        match *self {
            Self::Adam { beta1, beta2, .. } => [beta1, beta2],
            Self::Momentum { .. } | Self::GaussNewton { .. } => [0.0; 2],
        }
    }
}
