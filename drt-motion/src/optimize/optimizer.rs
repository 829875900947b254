use alloc::vec;
use alloc::vec::Vec;

use super::{Method, OptimizeError, Variable};

/// Everything that an [`Optimizer`] remembers, one number per variable in each list.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Steps taken.
    pub steps: u64,
    /// The values.
    pub values: Vec<f64>,
    /// Mean gradients (Adam) or accumulated ones (momentum).
    pub first: Vec<f64>,
    /// Mean squared gradients (Adam).
    pub second: Vec<f64>,
    /// β1ᵗ and β2ᵗ after t steps.
    pub unseen: [f64; 2],
}

/// Minimises a function of many variables by its gradients.
///
/// Steps that would lead out of a variable's bounds end on them. Where a variable is logarithmic,
/// gradients are still those by its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimizer {
    method: Method,
    variables: Vec<Variable>,
    state: State,
}

impl Optimizer {
    /// Begins at `start`.
    ///
    /// # Errors
    /// When a number is out of its range, or the lists differ in length.
    pub fn new(
        method: Method,
        variables: Vec<Variable>,
        start: &[f64],
    ) -> Result<Self, OptimizeError> {
        let zeros = vec![0.0; start.len()];
        let state = State {
            steps: 0,
            values: start.to_vec(),
            first: zeros.clone(),
            second: zeros,
            unseen: [1.0; 2],
        };
        Self::resume(method, variables, state)
    }

    /// Goes on from a stored state.
    ///
    /// # Errors
    /// As [`new`](Self::new), and when the state is not finite.
    pub fn resume(
        method: Method,
        variables: Vec<Variable>,
        state: State,
    ) -> Result<Self, OptimizeError> {
        method.check()?;
        let expected = variables.len();
        for (what, list) in
            [("values", &state.values), ("moments", &state.first), ("squares", &state.second)]
        {
            same_length(what, expected, list)?;
            all_finite(what, list)?;
        }
        for (i, (variable, value)) in variables.iter().zip(&state.values).enumerate() {
            variable.check(i, *value)?;
        }
        Ok(Self { method, variables, state })
    }

    /// The values now.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.state.values
    }

    /// What to store.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Takes one step against `gradient`, with every learning rate times `factor`.
    ///
    /// # Errors
    /// When the gradient has another length, or is not finite, or so is the value that a step leads to;
    /// nothing changes then.
    pub fn step(&mut self, gradient: &[f64], factor: f64) -> Result<(), OptimizeError> {
        same_length("the gradient", self.variables.len(), gradient)?;
        all_finite("the gradient", gradient)?;
        let mut next = self.state.clone();
        next.steps += 1;
        for (unseen, decay) in next.unseen.iter_mut().zip(self.method.decays()) {
            *unseen *= decay;
        }
        for (i, variable) in self.variables.iter().enumerate() {
            let value = next.values[i];
            let g = variable.chain(value, gradient[i]);
            let step = self.method.step(g, &mut next.first[i], &mut next.second[i], next.unseen);
            let rate = variable.learning_rate * factor;
            if rate != 0.0 {
                next.values[i] = variable.value(variable.coordinate(value) - rate * step);
            }
        }
        all_finite("the value after the step", &next.values)?;
        all_finite("the moments after the step", &next.first)?;
        all_finite("the squares after the step", &next.second)?;
        self.state = next;
        Ok(())
    }
}

fn same_length(what: &'static str, expected: usize, list: &[f64]) -> Result<(), OptimizeError> {
    if list.len() == expected {
        return Ok(());
    }
    Err(OptimizeError::Length { what, expected, found: list.len() })
}

fn all_finite(what: &'static str, list: &[f64]) -> Result<(), OptimizeError> {
    match list.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(variable) => Err(OptimizeError::NotFinite { variable, what }),
    }
}
