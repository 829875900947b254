use alloc::vec;
use alloc::vec::Vec;
use core::mem;

#[cfg(feature = "sparse")]
use drt_math::fm;

use super::FieldRule;
use crate::optimize::checks::{all_finite, same_length};
use crate::optimize::{Method, OptimizeError};

/// Everything that a [`FieldOptimizer`] remembers from one iteration to the next.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FieldState {
    /// The number of steps taken.
    pub steps: u64,
    /// The values of the field.
    pub values: Vec<f64>,
    /// For each value its mean gradient (Adam) or its accumulated one (momentum).
    pub first: Vec<f64>,
    /// For each value its mean squared gradient (Adam); empty with momentum, which needs none.
    pub second: Vec<f64>,
    /// Adam's β1ᵗ and β2ᵗ after t steps; with momentum 0 after the first step.
    pub unseen: [f64; 2],
}

/// Minimises a function of a field by its gradients.
///
/// Steps that would lead out of the bounds end on them. With a `LaplacianSmoothing` (feature `sparse`) the field has
/// some columns of numbers, side by side, for each vertex of a mesh, as many as its length says: 3 for coordinates.
#[derive(Clone, Debug)]
pub struct FieldOptimizer {
    rule: FieldRule,
    state: FieldState,
    /// The values before the last step, or nothing before the first one. It is not part of the state, which would
    /// be a third larger, as steps are judged before anything is stored.
    before: Vec<f64>,
}

impl FieldOptimizer {
    /// Begins at `start`.
    ///
    /// # Errors
    /// When a number of the rule is out of its range, its method is Gauss and Newton's, or a value of the start is
    /// not finite or not allowed by the rule. With a smoothing also when there are bounds or a logarithm, or when
    /// the length of the start is not a multiple of the number of vertices.
    pub fn new(rule: FieldRule, start: &[f64]) -> Result<Self, OptimizeError> {
        let zeros = vec![0.0; start.len()];
        let second = if has_squares(&rule.method) { zeros.clone() } else { Vec::new() };
        let state =
            FieldState { steps: 0, values: start.to_vec(), first: zeros, second, unseen: [1.0; 2] };
        Self::resume(rule, state)
    }

    /// Goes on from a stored state, to the same bits as if it had never stopped.
    ///
    /// # Errors
    /// As [`new`](Self::new), and when the lists of the state differ in length or hold something that is not finite.
    pub fn resume(rule: FieldRule, state: FieldState) -> Result<Self, OptimizeError> {
        rule.check(&state.values)?;
        let expected = state.values.len();
        let squares = if has_squares(&rule.method) { expected } else { 0 };
        for (what, expected, list) in
            [("moments", expected, &state.first), ("squares", squares, &state.second)]
        {
            same_length(what, expected, list)?;
            all_finite(what, list)?;
        }
        all_finite("a power of Adam's decays", &state.unseen)?;
        Ok(Self { rule, state, before: Vec::new() })
    }

    /// The values now.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.state.values
    }

    /// What to store in order to [`resume`](Self::resume).
    #[must_use]
    pub fn state(&self) -> &FieldState {
        &self.state
    }

    /// Takes one step against `gradient`, the derivatives of the loss by the values, with the learning rate that the
    /// rule has in `iteration` (counted from 0) times `factor`.
    ///
    /// # Errors
    /// When the gradient has another length than the field, or is not finite, or so is the value that the step leads
    /// to; nothing changes then.
    pub fn step(
        &mut self,
        gradient: &[f64],
        iteration: u32,
        factor: f64,
    ) -> Result<(), OptimizeError> {
        same_length("the gradient", self.state.values.len(), gradient)?;
        all_finite("the gradient", gradient)?;
        let (variable, method) = (self.rule.variable(), self.rule.method);
        let mut next = self.state.clone();
        next.steps += 1;
        for (unseen, decay) in next.unseen.iter_mut().zip(method.decays()) {
            *unseen *= decay;
        }
        let slopes = next.values.iter().map(|value| variable.slope(*value));
        let mut steps: Vec<f64> = gradient.iter().zip(slopes).map(|(g, slope)| g * slope).collect();
        #[cfg(feature = "sparse")]
        if let Some(smoothing) = &self.rule.smoothing {
            smoothing.pull_back(&mut steps)?;
        }
        for (i, step) in steps.iter_mut().enumerate() {
            let mut none = 0.0;
            let second = next.second.get_mut(i).unwrap_or(&mut none);
            *step = method
                .step(*step, &mut next.first[i], second, next.unseen)
                .ok_or(OptimizeError::FieldMethod)?;
        }
        all_finite("the moments after the step", &next.first)?;
        all_finite("the squares after the step", &next.second)?;
        #[cfg(feature = "sparse")]
        if let Some(smoothing) = &self.rule.smoothing {
            if let Method::Adam { epsilon, .. } = method {
                steps = uniform_steps(&next, epsilon);
            }
            smoothing.push_forward(&mut steps)?;
        }
        let rate = self.rule.learning_rate.at(iteration) * factor;
        if rate != 0.0 {
            for (value, step) in next.values.iter_mut().zip(&steps) {
                *value = variable.value(variable.coordinate(*value) - rate * step);
            }
        }
        all_finite("the value after the step", &next.values)?;
        self.before = mem::replace(&mut self.state, next).values;
        Ok(())
    }

    /// Takes back all but a `part` of the last step, from 0 (all of it is taken back) to 1 (nothing is): for steps
    /// that would fold a mesh. What is then left is the last step to the next call.
    ///
    /// A logarithmic field is left with that part of the change of its logarithms. The method remembers the gradient
    /// all the same. Nothing happens where no step was taken since the beginning or the
    /// [`resume`](Self::resume). Numbers below 0 and NaN count as 0, those above 1 as 1.
    pub fn shorten(&mut self, part: f64) {
        if part >= 1.0 {
            return;
        }
        let variable = self.rule.variable();
        for (value, before) in self.state.values.iter_mut().zip(&self.before) {
            if part > 0.0 {
                let [from, to] = [*before, *value].map(|v| variable.coordinate(v));
                if from != to {
                    *value = variable.value(from + part * (to - from));
                }
            } else {
                *value = *before;
            }
        }
    }
}

/// Whether a method remembers mean squares.
fn has_squares(method: &Method) -> bool {
    matches!(method, Method::Adam { .. })
}

/// Adam's steps with one second moment for the whole field, the largest of all values (Nicolet, Jacobson and Jakob
/// 2021): a factor for each value would make smooth directions rough.
#[cfg(feature = "sparse")]
fn uniform_steps(state: &FieldState, epsilon: f64) -> Vec<f64> {
    let largest = state.second.iter().copied().fold(0.0, f64::max);
    let [first, second] = state.unseen.map(|unseen| 1.0 - unseen);
    let scale = first * (fm::sqrt(largest / second) + epsilon);
    state.first.iter().map(|mean| mean / scale).collect()
}
