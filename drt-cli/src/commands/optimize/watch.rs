//! What tells that a fit cannot succeed.

use drt_estimators::Scene;
use drt_estimators::fit::{Evaluation, Fit, check_step};

use super::problem::Problem;
use crate::CliError;
use crate::error::Place;

/// Iterations in a row after which a parameter that changes nothing ends the fit.
const BLIND: u32 = 5;
/// Losses whose mean is compared with where the fit began.
const RECENT: usize = 5;
/// By how much that may exceed it.
const DIVERGED: f64 = 10.0;

/// Looks at every evaluation and step.
pub(super) struct Watch<'a> {
    problem: &'a Problem<'a>,
    /// Iterations in a row in which each parameter changed nothing.
    pub(super) blind: Vec<u32>,
    /// At the present values.
    scene: Scene,
}

impl<'a> Watch<'a> {
    pub(super) fn new(problem: &'a Problem<'a>, blind: Vec<u32>) -> Self {
        Self { problem, blind, scene: Scene::default() }
    }

    /// Takes note of where steps begin.
    pub(super) fn begin(&mut self, values: &[f64], fit: &mut Fit) -> Result<(), CliError> {
        self.scene = fit.scene_at(values).map_err(|e| self.problem.job.blame(&e))?.clone();
        Ok(())
    }

    /// Judges what iteration `i` saw; `losses` are those since the images last changed size, this one
    /// included.
    pub(super) fn evaluation(
        &mut self,
        i: u32,
        evaluation: &Evaluation,
        losses: &[f64],
    ) -> Result<(), CliError> {
        for (p, name) in self.problem.names().enumerate() {
            // What some views do not show others may.
            if !evaluation.sees_all() {
                continue;
            }
            let counts = evaluation.is_blind_to(p) && self.problem.varies(p);
            self.blind[p] = if counts { self.blind[p] + 1 } else { 0 };
            if counts && i == 0 {
                let message = format!(
                    "parameter `{name}` changes nothing that its targets show: its derivative is \
                     zero in every pixel; expected effects on something in view (a learning rate \
                     of 0 keeps a parameter as it is)"
                );
                return Err(CliError::input(&Place::file(&self.problem.job.path), message));
            }
            if self.blind[p] >= BLIND {
                return Err(CliError::unsolved(format!(
                    "iteration {i}: parameter `{name}` has changed nothing in any image for {BLIND} \
                     iterations: what it moves has left the view; lower its learning rate or give \
                     it `bounds`"
                )));
            }
        }
        let (Some(first), Some(last)) = (losses.first(), losses.last()) else { return Ok(()) };
        if !last.is_finite() {
            return Err(CliError::unsolved(format!("iteration {i}: the loss is {last}")));
        }
        let recent = &losses[losses.len().saturating_sub(RECENT)..];
        let mean = recent.iter().sum::<f64>() / recent.len() as f64;
        if losses.len() > RECENT && mean > DIVERGED * first {
            return Err(CliError::unsolved(format!(
                "iteration {i}: the loss diverges: {mean:.3e} on average over {RECENT} iterations, \
                 after {first:.3e} at first; lower the learning rate, or give parameters `bounds`"
            )));
        }
        Ok(())
    }

    /// Judges the step to these values: what is wrong with it, if anything is.
    pub(super) fn step(&mut self, values: &[f64], fit: &mut Fit) -> Result<(), String> {
        let next = fit.scene_at(values).map_err(|e| e.to_string())?;
        let sensors: Vec<usize> = self.problem.views.iter().map(|v| v.sensor).collect();
        check_step(&self.scene, next, &sensors).map_err(|e| e.to_string())?;
        self.scene = next.clone();
        Ok(())
    }

    /// The end of a fit whose step from iteration `i` to these values is not possible.
    pub(super) fn impossible(&self, i: u32, values: &[f64], what: &str) -> CliError {
        let values = self.problem.names().zip(values).map(|(n, v)| format!("{n} = {v:.6}"));
        CliError::unsolved(format!(
            "iteration {i}: the step to {} is not possible: {what}; lower the learning rate, \
             or give parameters `bounds`",
            values.collect::<Vec<_>>().join(", ")
        ))
    }
}
