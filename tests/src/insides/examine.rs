//! One derivative by several ways, compared.

use std::fmt;
use std::time::Instant;

use drt_estimators::{Agreement, Layer, Session, Settings, Unattended, agreement};

use super::{Case, Way};
use crate::Result;

/// Samples per pixel of the first round; each further one doubles them.
const ROUND: u32 = 1 << 9;

/// How much is computed.
#[derive(Clone, Copy, Debug)]
struct Effort {
    noise: f64,
    samples: u32,
}

/// A derivative image by one way, and whether it is that of the first.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The name of the way.
    pub way: &'static str,
    /// The comparison.
    pub agreement: Agreement,
    /// Relative noise.
    pub noise: f64,
    /// Per pixel.
    pub samples: u32,
    /// Time taken.
    pub seconds: f64,
}

/// What the ways of a case show.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Of the case.
    pub name: &'static str,
    /// Relative noise asked for.
    pub limit: f64,
    /// The right ways, the first of which the others are compared with.
    pub right: Vec<Verdict>,
    /// The wrong ones.
    pub wrong: Vec<Verdict>,
    /// Contributions that were no numbers.
    pub non_finite: u64,
}

impl Finding {
    /// True when the right ways agree, the wrong ones do not, and all are as precise as asked for.
    #[must_use]
    pub fn holds(&self) -> bool {
        let right = self.right.iter().all(|v| v.agreement.agrees && v.noise <= self.limit);
        right && !self.wrong.iter().any(|v| v.agreement.agrees) && self.non_finite == 0
    }
}

/// Computes every way to a relative noise, or to a number of samples per pixel.
///
/// # Errors
/// When the library rejects the scene or a way.
pub fn examine(case: &Case, noise: f64, samples: u32) -> Result<Finding> {
    let mut first: Option<Run> = None;
    let mut non_finite = 0;
    let mut judge = |seed: u64, way: &Way, noise: f64| -> Result<Verdict> {
        // Where velocities jump, the noise that the right ways reach may never come.
        let samples = if noise > 0.0 { samples } else { first.as_ref().map_or(0, |f| f.samples) };
        let run = compute(case, way, Effort { noise, samples }, seed)
            .map_err(|e| format!("{}, {}: {e}", case.name, way.name))?;
        non_finite += run.non_finite;
        let first = first.get_or_insert_with(|| run.clone());
        Ok(Verdict {
            way: way.name,
            agreement: agreement(&run.layer, &first.layer, None),
            noise: run.layer.relative_noise(None),
            samples: run.samples,
            seconds: run.seconds,
        })
    };
    // Other random numbers for each, so that their errors are independent.
    let right = (1..).zip(&case.right).map(|(seed, way)| judge(seed, way, noise));
    let right = right.collect::<Result<_>>()?;
    let wrong = (101..).zip(&case.wrong).map(|(seed, way)| judge(seed, way, 0.0));
    let wrong = wrong.collect::<Result<_>>()?;
    Ok(Finding { name: case.name, limit: noise, right, wrong, non_finite })
}

#[derive(Clone)]
struct Run {
    layer: Layer,
    samples: u32,
    seconds: f64,
    non_finite: u64,
}

fn compute(case: &Case, way: &Way, effort: Effort, seed: u64) -> Result<Run> {
    let start = Instant::now();
    let insides = way.insides.clone();
    let settings = Settings { threads: 1, seed, insides, ..Settings::default() };
    let mut session = Session::new(&case.scene, &[way.parameter.clone()], &settings)?;
    let (mut samples, mut next) = (0, ROUND);
    loop {
        session.run(next, &Unattended);
        samples += next;
        let rendering = session.rendering();
        let non_finite = rendering.non_finite;
        let layer = rendering.derivatives.into_iter().next().ok_or("no derivative")?.total;
        let left = layer.relative_noise(None) / effort.noise;
        if left <= 1.0 || samples >= effort.samples {
            let seconds = start.elapsed().as_secs_f64();
            return Ok(Run { layer, samples, seconds, non_finite });
        }
        // Up to the noise asked for by what has been seen, and a little further.
        let wanted = (f64::from(samples) * (1.1 * left * left - 1.0)).ceil();
        next = wanted.clamp(f64::from(ROUND), f64::from(4 * samples)) as u32;
        next = next.min(effort.samples - samples);
    }
}

/// Findings as a table for a reader of test output.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a>(pub &'a Finding);

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(finding) = self;
        let head = ["rms z", "max z", "limit", "noise", "spp", "s"];
        write!(f, "\n{:<44}", finding.name)?;
        for head in head {
            write!(f, " {head:>7}")?;
        }
        writeln!(f)?;
        let right = finding.right.iter().map(|v| ("", v, v.agreement.agrees));
        let wrong = finding.wrong.iter().map(|v| ("wrong: ", v, !v.agreement.agrees));
        for (kind, v, as_expected) in right.chain(wrong) {
            let a = &v.agreement;
            write!(f, "  {:<42}", format!("{kind}{}", v.way))?;
            write!(f, " {:>7.2} {:>7.2} {:>7.2}", a.rms_z, a.max_z, a.limit)?;
            write!(f, " {:>6.2}% {:>7} {:>7.1}", 100.0 * v.noise, v.samples, v.seconds)?;
            writeln!(f, "{}", if as_expected { "" } else { "  <<< FAILS" })?;
        }
        if finding.non_finite > 0 {
            writeln!(f, "  {} contributions not finite", finding.non_finite)?;
        }
        Ok(())
    }
}
