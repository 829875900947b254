//! Measurements that go on until they are precise enough.

use std::time::Instant;

use drt_estimators::{Estimate, Rendering, Session, Unattended};
use drt_motion::Parameter;

use crate::Result;
use crate::trial::Trial;

/// How precise a measurement has to be, and how much it may cost.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Standard error over the number's scale.
    pub noise: f64,
    /// The part of the largest derivative below which a derivative counts as near zero.
    pub near_zero: f64,
    /// The largest derivative is that of the whole case, not of the scene alone.
    pub of_case: bool,
    /// Samples after which it is given up.
    pub samples: u32,
}

/// A number with its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// The mean.
    pub mean: f64,
    /// The standard error of it.
    pub stderr: f64,
}

/// A value and its derivatives.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// The value.
    pub value: Number,
    /// A derivative per parameter.
    pub derivatives: Vec<Number>,
    /// Samples taken.
    pub samples: u32,
    /// Time spent.
    pub seconds: f64,
    /// Contributions that were no numbers.
    pub non_finite: u64,
}

impl Effort {
    /// What the noise of each derivative is compared with: its size, or where that is near zero, the
    /// size of the largest (that of the value, where all are zero).
    #[must_use]
    pub fn scales(&self, trial: &Trial) -> Vec<f64> {
        let derivatives = || trial.parameters.iter().map(|(_, d)| d);
        let largest = if self.of_case {
            trial.largest_of_case
        } else {
            derivatives().fold(0.0_f64, |m, d| m.max(d.abs()))
        };
        let largest = if largest > 0.0 { largest } else { trial.value.abs() };
        let scale = |d: &f64| if d.abs() < self.near_zero * largest { largest } else { d.abs() };
        derivatives().map(scale).collect()
    }
}

/// Runs a trial until value and derivatives are precise enough, or effort is spent.
///
/// # Errors
/// When the library rejects the scene.
pub fn measure(trial: &Trial, effort: &Effort) -> Result<Measurement> {
    let parameters: Vec<Parameter> = trial.parameters.iter().map(|(p, _)| p.clone()).collect();
    let (value_scale, scales) = (trial.value.abs(), effort.scales(trial));
    let start = Instant::now();
    let mut session = Session::new(&trial.built.scene, &parameters, &trial.settings())
        .map_err(|e| format!("{}: {e}", trial.name))?;
    let mut samples = 0;
    let mut next = 1 << 12;
    loop {
        session.run(next, &Unattended);
        samples += next;
        let result = session.rendering();
        let mut measured = numbers(&result, trial.unit);
        let noise = measured.noise(value_scale, &scales);
        if noise <= effort.noise || samples >= effort.samples {
            measured.seconds = start.elapsed().as_secs_f64();
            return Ok(measured);
        }
        // Errors fall with the square root, and are known only roughly at first.
        let missing = 1.1 * (noise / effort.noise).powi(2) - 1.0;
        let wanted = (f64::from(samples) * missing.clamp(0.2, 3.0)) as u32;
        next = wanted.min(effort.samples - samples).max(32);
    }
}

impl Measurement {
    /// The largest standard error relative to its scale.
    #[must_use]
    pub fn noise(&self, value_scale: f64, scales: &[f64]) -> f64 {
        let of = |(n, scale): (&Number, &f64)| n.stderr / scale;
        let derivatives = self.derivatives.iter().zip(scales).map(of);
        derivatives.fold(self.value.stderr / value_scale, f64::max)
    }
}

fn numbers(result: &Rendering, unit: f64) -> Measurement {
    // Scenes are grey.
    let number = |e: &Estimate| Number { mean: e.mean.g * unit, stderr: e.stderr.g * unit };
    Measurement {
        value: number(&result.image.total),
        derivatives: result.derivatives.iter().map(|d| number(&d.total.total)).collect(),
        samples: result.spp,
        seconds: 0.0,
        non_finite: result.non_finite,
    }
}
