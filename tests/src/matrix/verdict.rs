//! Derivatives against finite differences, and against the same with a planted fault.

use std::fmt;
use std::time::Instant;

use drt_estimators::{
    Agreement, Derivative, Layer, Session, Settings, Term, Unattended, agreement,
    finite_differences,
};
use drt_motion::Parameter;

use super::{Cell, Stage};
use crate::Result;

/// Errors of finite differences below this part of the image's rms are not told apart.
const RESOLUTION: f64 = 5e-3;

/// Terms from this part of the derivative on must not pass with the wrong sign.
pub(super) const SIGNIFICANT: f64 = 0.3;

/// A cell's verdict.
#[derive(Clone, Debug)]
pub struct Row {
    /// Name of the stage.
    pub stage: &'static str,
    /// Name of the parameter.
    pub parameter: String,
    /// The comparison.
    pub agreement: Agreement,
    /// Relative noise of the derivative's block means, and of the finite difference's.
    pub noise: [f64; 2],
    /// Difference of the finite differences of both steps over their size.
    pub step_error: f64,
    /// Block means of each term over those of the finite difference, rms.
    pub terms: Vec<(Term, f64)>,
    /// What was planted, and the comparisons then.
    pub faults: Vec<Fault>,
    /// Contributions that were no numbers.
    pub non_finite: u64,
    /// Time taken.
    pub seconds: f64,
}

impl Row {
    /// True when the derivative agrees, and a wrong one would not.
    #[must_use]
    pub fn passes(&self) -> bool {
        let unseen = |fault: &Fault| fault.agreement.agrees;
        self.agreement.agrees && !self.faults.iter().any(unseen) && self.non_finite == 0
    }
}

/// A derivative with one term multiplied by a factor.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    /// The term.
    pub term: Term,
    /// The factor.
    pub factor: f64,
    /// The comparison with finite differences.
    pub agreement: Agreement,
}

/// Checks every cell of a stage.
///
/// # Errors
/// When the library rejects the scene or a parameter.
pub fn check(stage: &Stage) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    // A parameter that is not at rest changes the scene for all of its run.
    let at_rest = |c: &Cell| c.parameter.value == 0.0;
    for cells in stage.cells.chunk_by(|a, b| at_rest(a) && at_rest(b)) {
        let parameters: Vec<Parameter> = cells.iter().map(|c| c.parameter.clone()).collect();
        let start = Instant::now();
        // Tests run side by side; each keeps to one thread.
        let settings = Settings {
            threads: 1,
            seed: 7,
            boundary_ratio: Some(f64::from(stage.boundary_samples) / f64::from(stage.samples)),
            terms: true,
            insides: stage.insides.clone(),
            ..Settings::default()
        };
        let mut session = Session::new(&stage.scene, &parameters, &settings)?;
        session.run(stage.samples, &Unattended);
        let rendering = session.rendering();
        let share = start.elapsed().as_secs_f64() / cells.len() as f64;
        let radiance = rendering.image.rms_value();
        for (cell, derivative) in cells.iter().zip(&rendering.derivatives) {
            let mut row = compare(stage, cell, derivative, radiance)?;
            row.non_finite = rendering.non_finite;
            row.seconds += share;
            rows.push(row);
        }
    }
    Ok(rows)
}

/// Judges a derivative of an image of about the given radiance.
fn compare(stage: &Stage, cell: &Cell, derivative: &Derivative, radiance: f64) -> Result<Row> {
    let start = Instant::now();
    let settings = Settings { threads: 1, seed: 11, ..Settings::default() };
    let parameters = [cell.parameter.clone()];
    let difference = |step: f64| -> Result<Layer> {
        let Stage { scene, .. } = stage;
        let layers =
            finite_differences(scene, &parameters, &settings, cell.samples, step, &Unattended)?;
        Ok(layers.into_iter().next().ok_or("no finite difference")?)
    };
    let (whole, mut half) = (difference(cell.step)?, difference(0.5 * cell.step)?);
    let change = plus(&whole, -1.0, &half);
    // Blocks where next to nothing happens would be judged by the few samples that say so.
    let mut least = RESOLUTION * half.rms_value();
    if derivative.terms.iter().any(|(t, l)| *t != Term::Interior && l.rms_value() > 0.0) {
        // One sample more or less for which an edge passes between both images.
        let samples = half.pixels.len() / half.blocks.len() * cell.samples as usize;
        least = least.max(radiance / (cell.step * samples as f64));
    }
    for block in &mut half.blocks {
        block.stderr = block.stderr.map(|e| e.max(least));
    }
    let total = &derivative.total;
    let judge = |derivative: &Layer| agreement(derivative, &half, Some(&change));
    let size = half.rms_value();
    let terms: Vec<(Term, f64)> =
        derivative.terms.iter().map(|(t, l)| (*t, l.rms_value() / size)).collect();
    let largest = terms.iter().map(|(_, part)| *part).fold(0.0, f64::max);
    let mut faults = Vec::new();
    for ((term, part), (_, layer)) in terms.iter().zip(&derivative.terms) {
        let mut plant = |factor: f64| {
            let agreement = judge(&plus(total, factor - 1.0, layer));
            faults.push(Fault { term: *term, factor, agreement });
        };
        if *part >= SIGNIFICANT {
            plant(-1.0);
        }
        if cell.precise && *part == largest {
            plant(1.03);
        }
    }
    Ok(Row {
        stage: stage.name,
        parameter: cell.parameter.name.clone(),
        agreement: judge(total),
        noise: [total, &half].map(|l| l.relative_noise(Some(size))),
        step_error: change.rms_value() / size,
        terms,
        faults,
        non_finite: 0,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Block means of `a + factor b`, with the errors of `a`.
pub(crate) fn plus(a: &Layer, factor: f64, b: &Layer) -> Layer {
    let mut sum = a.clone();
    for (s, b) in sum.blocks.iter_mut().zip(&b.blocks) {
        s.mean += b.mean * factor;
    }
    sum
}

/// Rows as a table for a reader of test output.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a>(pub &'a [Row]);

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let heads = ["rms z", "max z", "limit", "noise", "fd", "step", "s"];
        write!(f, "\n{:<44}", "")?;
        for head in heads {
            write!(f, " {head:>6}")?;
        }
        writeln!(f, "  terms; faults planted and their rms z")?;
        for row in self.0 {
            let name = format!("{}: {}", row.stage, row.parameter);
            let a = &row.agreement;
            write!(f, "{name:<44} {:>6.2} {:>6.2} {:>6.2}", a.rms_z, a.max_z, a.limit)?;
            for part in [row.noise[0], row.noise[1], row.step_error] {
                write!(f, " {:>5.1}%", 100.0 * part)?;
            }
            write!(f, " {:>6.1} ", row.seconds)?;
            for (term, part) in row.terms.iter().filter(|(_, part)| *part >= 5e-3) {
                write!(f, " {} {part:.2}", term.name())?;
            }
            for fault in &row.faults {
                let Fault { term, factor, agreement } = fault;
                write!(f, "; {} × {factor}: {:.1}", term.name(), agreement.rms_z)?;
            }
            if row.non_finite > 0 {
                write!(f, "  {} contributions not finite", row.non_finite)?;
            }
            writeln!(f, "{}", if row.passes() { "" } else { "  <<< FAILS" })?;
        }
        Ok(())
    }
}
