//! Derivatives against finite differences, and against the same with a planted fault.

use std::fmt;

use drt_estimators::{Agreement, Derivative, Layer, Term, agreement};

use super::Cell;
use super::estimators::{Method, Sampled};
use super::scale::{Halves, Scale};
use crate::reference::{RESOLUTION, Reference, at_least};

/// Terms from this part of the derivative on must not pass with the wrong sign.
pub(super) const SIGNIFICANT: f64 = 0.3;

/// The factor that must not pass where a cell is known precisely.
const OFF: f64 = 1.03;

/// A single number agrees within this many standard errors.
pub(super) const MOST_ERRORS: f64 = 4.0;

/// A cell's verdict.
#[derive(Clone, Debug)]
pub struct Row {
    /// Name of the stage.
    pub stage: &'static str,
    /// Name of the parameter.
    pub parameter: String,
    /// The estimator in question.
    pub method: Method,
    /// The comparison.
    pub agreement: Agreement,
    /// How much larger the derivative is than the finite difference.
    pub scale: Scale,
    /// Relative noise of the derivative's block means, and of the finite difference's.
    pub noise: [f64; 2],
    /// Difference of the finite differences of both steps over their size.
    pub step_error: f64,
    /// Block means of each term over those of the finite difference, rms.
    pub terms: Vec<(Term, f64)>,
    /// What was planted, and whether it was seen.
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
        let unseen = |fault: &Fault| fault.must_be_seen && !fault.is_seen;
        let right = self.agreement.agrees && self.scale.z() <= MOST_ERRORS;
        right && !self.faults.iter().any(unseen) && self.non_finite == 0
    }
}

/// A derivative with one term multiplied by a factor.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    /// The term.
    pub term: Term,
    /// The factor.
    pub factor: f64,
    /// The rms z of the comparison by blocks.
    pub rms_z: f64,
    /// How many standard errors the scale is off by.
    pub scale_z: f64,
    /// Whether the derivative was rejected.
    pub is_seen: bool,
    /// Whether the noise is small enough for that.
    pub must_be_seen: bool,
}

/// Judges the derivative that was sampled of a cell, the one with a number in its run.
pub(super) fn judge(
    stage: &'static str,
    method: Method,
    (cell, number): (&Cell, usize),
    sampled: &Sampled,
    reference: &Reference,
) -> Row {
    let [first, all] = [&sampled.first, &sampled.all].map(|r| &r.derivatives[number]);
    let half = resolved(reference, cell, sampled, all);
    let change = reference.change();
    let compare = |[first, all]: [&Layer; 2]| {
        let agreement = agreement(all, &half, Some(&change));
        (agreement, Scale::against(Halves { first, all }, &half, &change))
    };
    let (agreement, scale) = compare([&first.total, &all.total]);
    let size = half.rms_value();
    let noise = [&all.total, &half].map(|l| l.relative_noise(Some(size)));
    let terms: Vec<(Term, f64)> =
        all.terms.iter().map(|(t, l)| (*t, l.rms_value() / size)).collect();
    let largest = terms.iter().map(|(_, part)| *part).fold(0.0, f64::max);
    let plant = |k: usize, factor: f64, must_be_seen: bool| {
        let wrong = [first, all].map(|d| plus(&d.total, factor - 1.0, &d.terms[k].1));
        let (agreement, scale) = compare([&wrong[0], &wrong[1]]);
        let is_seen = !agreement.agrees || scale.z() > MOST_ERRORS;
        let (term, rms_z, scale_z) = (terms[k].0, agreement.rms_z, scale.z());
        Fault { term, factor, rms_z, scale_z, is_seen, must_be_seen }
    };
    let is_path_space = method == Method::REFERENCE;
    let mut faults = Vec::new();
    for (k, (_, part)) in terms.iter().enumerate() {
        if *part >= SIGNIFICANT {
            // A term of the wrong sign is off by twice its size.
            let clear = 2.0 * part > 3.0 * noise[0].hypot(noise[1]);
            faults.push(plant(k, -1.0, is_path_space || clear));
        }
        if *part == largest {
            let clear = (OFF - 1.0) * part > 2.0 * MOST_ERRORS * scale.stderr;
            faults.push(plant(k, OFF, clear || is_path_space && cell.precise));
        }
    }
    Row {
        stage,
        parameter: cell.parameter.name.clone(),
        method,
        agreement,
        scale,
        noise,
        step_error: change.rms_value() / size,
        terms,
        faults,
        non_finite: sampled.all.non_finite,
        seconds: sampled.seconds / sampled.all.derivatives.len() as f64,
    }
}

/// The finite difference with errors that are not too small. Blocks where next to nothing happens would be judged by the few samples that say so.
fn resolved(reference: &Reference, cell: &Cell, sampled: &Sampled, all: &Derivative) -> Layer {
    let half = reference.layer();
    let mut least = RESOLUTION * half.rms_value();
    if all.terms.iter().any(|(t, l)| *t != Term::Interior && l.rms_value() > 0.0) {
        // One sample more or less for which an edge passes between both images.
        let pixels = all.total.pixels.len() / half.blocks.len();
        let samples = pixels as f64 * f64::from(reference.samples);
        least = least.max(sampled.all.image.rms_value() / (cell.step * samples));
    }
    at_least(half, least)
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
        write!(f, "\n{:<54}", "")?;
        for head in heads {
            write!(f, " {head:>6}")?;
        }
        writeln!(f, "  scale            terms; faults planted, their rms z, and z of their scale")?;
        for row in self.0 {
            let name = format!("{}: {}, {:?}", row.stage, row.parameter, row.method.0);
            let a = &row.agreement;
            write!(f, "{name:<54} {:>6.2} {:>6.2} {:>6.2}", a.rms_z, a.max_z, a.limit)?;
            for part in [row.noise[0], row.noise[1], row.step_error] {
                write!(f, " {:>5.1}%", 100.0 * part)?;
            }
            write!(f, " {:>6.1} ", row.seconds)?;
            let Scale { off, stderr } = row.scale;
            write!(f, " {:>+6.2} ± {:>5.2}% ", 100.0 * off, 100.0 * stderr)?;
            for (term, part) in row.terms.iter().filter(|(_, part)| *part >= 5e-3) {
                write!(f, " {} {part:.2}", term.name())?;
            }
            for fault in &row.faults {
                let Fault { term, factor, rms_z, scale_z, is_seen, must_be_seen } = fault;
                write!(f, "; {} × {factor}: {rms_z:.1} {scale_z:.1}", term.name())?;
                match (is_seen, must_be_seen) {
                    (false, true) => write!(f, " (unseen)")?,
                    (false, false) => write!(f, " (in noise)")?,
                    _ => {}
                }
            }
            if row.non_finite > 0 {
                write!(f, "  {} contributions not finite", row.non_finite)?;
            }
            writeln!(f, "{}", if row.passes() { "" } else { "  <<< FAILS" })?;
        }
        Ok(())
    }
}
