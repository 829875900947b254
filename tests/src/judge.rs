//! The verdict on measurements, and its table.

use std::fmt;

use crate::measure::{Effort, Measurement, Number};
use crate::trial::Trial;

/// Standard errors that a number may be off.
pub const LIMIT: f64 = 4.0;

/// One number of a trial, measured and known.
#[derive(Clone, Debug)]
pub struct Row {
    /// The trial's name.
    pub trial: String,
    /// `value`, or the parameter's name.
    pub what: String,
    /// What was measured.
    pub measured: Number,
    /// What is known.
    pub expected: f64,
    /// What noise is relative to.
    pub scale: f64,
    /// Deviation allowed besides noise, relative to the scale.
    pub bias: f64,
    /// Relative noise asked for.
    pub noise_limit: f64,
    /// Samples taken for the whole trial.
    pub samples: u32,
    /// Time taken for the whole trial.
    pub seconds: f64,
}

impl Row {
    /// The deviation in standard errors.
    #[must_use]
    pub fn z(&self) -> f64 {
        let off = self.measured.mean - self.expected;
        if off == 0.0 { 0.0 } else { off / self.measured.stderr }
    }

    /// The standard error relative to the scale.
    #[must_use]
    pub fn noise(&self) -> f64 {
        self.measured.stderr / self.scale
    }

    /// True when the number is right within its error, and the error is as small as asked for.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.agrees_with(self.expected) && self.noise() <= self.noise_limit
    }

    /// True when the measured number could be `expected`.
    #[must_use]
    pub fn agrees_with(&self, expected: f64) -> bool {
        let off = (self.measured.mean - expected).abs();
        off <= LIMIT * self.measured.stderr + self.bias * self.scale
    }
}

/// The rows of a trial: its value, and its derivatives in order.
#[must_use]
pub fn rows(trial: &Trial, measured: &Measurement, effort: &Effort) -> Vec<Row> {
    let row = |what: &str, number: Number, expected: f64, scale: f64| Row {
        trial: trial.name.clone(),
        what: what.into(),
        measured: number,
        expected,
        scale,
        bias: trial.bias,
        noise_limit: effort.noise,
        samples: measured.samples,
        seconds: measured.seconds,
    };
    let mut rows = vec![row("value", measured.value, trial.value, trial.value.abs())];
    let derivatives = trial.parameters.iter().zip(&measured.derivatives);
    let scales = effort.scales(trial);
    rows.extend(derivatives.zip(scales).map(|(((p, d), n), s)| row(&p.name, *n, *d, s)));
    rows
}

/// Rows as a table for a reader of test output.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a>(pub &'a [Row]);

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut trial = "";
        for row in self.0 {
            if row.trial != trial {
                trial = &row.trial;
                let (samples, seconds) = (row.samples, row.seconds);
                writeln!(f, "\n{trial}   ({samples} samples, {seconds:.1} s)")?;
                writeln!(
                    f,
                    "  {:<50} {:>14} {:>11} {:>14} {:>7} {:>8}",
                    "", "measured", "± error", "oracle", "z", "noise"
                )?;
            }
            writeln!(
                f,
                "  {:<50} {:>14.6e} {:>11.2e} {:>14.6e} {:>7.2} {:>7.3}%{}",
                row.what,
                row.measured.mean,
                row.measured.stderr,
                row.expected,
                row.z(),
                100.0 * row.noise(),
                if row.passes() { "" } else { "  <<< FAILS" },
            )?;
        }
        Ok(())
    }
}
