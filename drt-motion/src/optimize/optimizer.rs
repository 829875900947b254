use alloc::vec;
use alloc::vec::Vec;

use super::checks::{all_finite, same_length};
use super::{Averages, Method, Observation, OptimizeError, Variable};

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
    /// What Gauss-Newton steps follow from.
    #[cfg_attr(feature = "serde", serde(default))]
    pub averages: Option<Averages>,
}

/// How well values are known, one number per variable in each list.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlook {
    /// What the next step would add to the values if nothing limited it.
    pub step: Vec<f64>,
    /// Standard errors of the values, as far as the noise of all that was averaged leads them astray.
    pub errors: Vec<f64>,
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
            averages: None,
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
        if let Some(averages) = &state.averages {
            averages.check(expected)?;
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

    /// Takes a variable back to a value between that before the last step and the one it led to, as where the step led
    /// out of what has a meaning.
    ///
    /// # Errors
    /// When the value is not finite or not within the variable's bounds, or there is no such variable.
    pub fn take_back(&mut self, variable: usize, value: f64) -> Result<(), OptimizeError> {
        let expected = self.variables.len();
        let (Some(of), Some(slot)) =
            (self.variables.get(variable), self.state.values.get_mut(variable))
        else {
            return Err(OptimizeError::Length { what: "variables", expected, found: variable + 1 });
        };
        of.check(variable, value)?;
        *slot = value;
        Ok(())
    }

    /// What to store.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Where the goal seems to be and how well the values are known, by all that was seen before and what
    /// is `seen` now, at the values and not stepped by yet. `None` where steps are not made of averages,
    /// and where what was seen does not tell the variables apart.
    ///
    /// # Errors
    /// As [`step_by`](Self::step_by).
    pub fn outlook(
        &self,
        seen: Option<&Observation<'_>>,
    ) -> Result<Option<Outlook>, OptimizeError> {
        let Method::GaussNewton { memory } = self.method else { return Ok(None) };
        let slopes = self.slopes();
        let mut averages = self.state.averages.clone();
        if let Some(seen) = seen {
            seen.check(slopes.len())?;
            averages
                .get_or_insert_with(|| Averages::new(slopes.len()))
                .observe(seen, &slopes, memory)
                .ok_or(OptimizeError::NotSquares)?;
        }
        let by_value = |list: Vec<f64>| list.iter().zip(&slopes).map(|(x, s)| x * s).collect();
        let found = averages.and_then(|averages| averages.outlook());
        Ok(found.map(|found| {
            let [step, errors] = found.map(by_value);
            Outlook { step, errors }
        }))
    }

    /// The derivatives of the values by their coordinates.
    fn slopes(&self) -> Vec<f64> {
        let variables = self.variables.iter().zip(&self.state.values);
        variables.map(|(variable, value)| variable.slope(*value)).collect()
    }

    /// Takes one step by all that was seen at the values, with every learning rate times `factor`. Methods
    /// that need no more than gradients look at no more.
    ///
    /// # Errors
    /// As [`step`](Self::step), and when matrices have another size, or are not those of a sum of squares.
    pub fn step_by(&mut self, seen: &Observation<'_>, factor: f64) -> Result<(), OptimizeError> {
        let Method::GaussNewton { memory } = self.method else {
            return self.step(seen.gradient, factor);
        };
        let n = self.variables.len();
        seen.check(n)?;
        let mut next = self.state.clone();
        next.steps += 1;
        let slopes = self.slopes();
        let variables = self.variables.iter().zip(&self.state.values);
        let limit = |(v, value): (&Variable, &f64)| v.limits(*value, v.learning_rate * factor);
        let limits: Vec<[f64; 2]> = variables.map(limit).collect();
        let averages = next.averages.get_or_insert_with(|| Averages::new(n));
        let step = averages
            .observe(seen, &slopes, memory)
            .and_then(|()| averages.step(&limits))
            .ok_or(OptimizeError::NotSquares)?;
        averages.check(n)?;
        for ((value, variable), change) in next.values.iter_mut().zip(&self.variables).zip(step) {
            if change != 0.0 {
                *value = variable.value(variable.coordinate(*value) + change);
            }
        }
        all_finite("the value after the step", &next.values)?;
        self.state = next;
        Ok(())
    }

    /// Takes one step against `gradient`, with every learning rate times `factor`.
    ///
    /// # Errors
    /// When the gradient has another length, or is not finite, or so is the value that a step leads to, or
    /// the method needs more; nothing changes then.
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
            let g = gradient[i] * variable.slope(value);
            let step = self
                .method
                .step(g, &mut next.first[i], &mut next.second[i], next.unseen)
                .ok_or(OptimizeError::NoCurvature)?;
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
