//! One derivative by several ways, compared.

use std::fmt;
use std::time::Instant;

use drt_estimators::{Agreement, Estimate, Layer, Session, Settings, Unattended, agreement};
use drt_math::Rgb;

use super::{Case, Way};
use crate::Result;
use crate::reference::{self, Reference, Wanted};

/// Samples per pixel of the first round.
const ROUND: u32 = 1 << 10;

/// Samples per pixel that tell whether two ways are the same.
const FEW: u32 = 1 << 5;

/// Rms z at which what is wrong has shown.
const CLEAR: f64 = 2.0;

/// Samples of what is wrong before it counts as unnoticed, over those of the first way.
const PATIENCE: u32 = 16;

/// Samples per pixel of the first finite differences, and of the last.
const DIFFERENCES: u32 = 1 << 12;
const MOST_DIFFERENCES: u32 = 1 << 20;

/// How much noisier than the other ways finite differences may be.
const COARSER: f64 = 3.0;

/// The names of stored references.
const FIRST: &str = "first way";
const DIFFERENCES_NAME: &str = "finite differences";

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
    /// The right ways, the first of which the others are compared with, without those that are the same as the first.
    pub right: Vec<Verdict>,
    /// The wrong ones.
    pub wrong: Vec<Verdict>,
    /// Finite differences, if the case asks for them.
    pub differences: Option<Verdict>,
    /// Contributions that were no numbers.
    pub non_finite: u64,
}

impl Finding {
    /// True when the right ways agree, the wrong ones do not, and all are as precise as asked for.
    #[must_use]
    pub fn holds(&self) -> bool {
        let right = self.right.iter().all(|v| v.agreement.agrees && v.noise <= self.limit);
        let differences =
            self.differences.iter().all(|v| v.agreement.agrees && v.noise <= COARSER * self.limit);
        right
            && differences
            && !self.wrong.iter().any(|v| v.agreement.agrees)
            && self.non_finite == 0
    }
}

/// How much less noise stored references have than what is judged by them.
const FINER: f64 = 4.0;

/// Samples per pixel of the stored finite differences.
const LONG_DIFFERENCES: u32 = 1 << 14;

/// The first way with little noise, and finite differences if the case asks for them, as they are stored.
///
/// # Errors
/// When the library rejects the scene or a way.
pub fn references(case: &Case, noise: f64, seed: u64) -> Result<Vec<Reference>> {
    let way = &case.right[0];
    let mut run = Run::new(case, way, seed)?;
    while run.noise() > noise / FINER {
        run.go_on(noise / FINER, u32::MAX);
    }
    let mut all = vec![Reference {
        name: FIRST.into(),
        fingerprint: 0,
        samples: run.samples,
        seed,
        step: 0.0,
        change: vec![Rgb::ZERO; run.layer.blocks.len()],
        blocks: run.layer.blocks,
    }];
    if let Some(step) = case.step {
        let (scene, parameter) = (&case.scene, &way.parameter);
        let found = Reference::by_differences(scene, parameter, step, LONG_DIFFERENCES, seed)?;
        all.push(Reference { name: DIFFERENCES_NAME.into(), ..found });
    }
    let of = fingerprint_of(case);
    Ok(all.into_iter().map(|reference| reference.standing_for(of)).collect())
}

/// The [references] that are stored.
///
/// # Errors
/// When one is missing, cannot be read, or stands for another scene than the case has.
pub fn stored(case: &Case) -> Result<Vec<Reference>> {
    let names = [Some(FIRST), case.step.map(|_| DIFFERENCES_NAME)];
    let wanted = names.into_iter().flatten().map(|name| Wanted {
        name,
        fingerprint: fingerprint_of(case),
        samples: None,
    });
    reference::stored(case.name, &wanted.collect::<Vec<_>>())
}

fn fingerprint_of(case: &Case) -> u64 {
    let step = case.step.unwrap_or_default();
    reference::fingerprint(case.name, &case.scene, &case.right[0].parameter, step)
}

/// Computes every right way to a relative noise, or to a number of samples per pixel, and every wrong
/// one until it shows, at most with a few times the samples of the first. All are judged by the `known` references, or
/// without any by the first way and by finite differences of now.
///
/// # Errors
/// When the library rejects the scene or a way.
pub fn examine(case: &Case, noise: f64, samples: u32, known: &[Reference]) -> Result<Finding> {
    let fail = |way: &Way, e: drt_estimators::Error| format!("{}, {}: {e}", case.name, way.name);
    let mut right: Vec<Verdict> = Vec::new();
    let mut wrong = Vec::new();
    let mut reference = known.first().map(Reference::layer);
    let mut own: Option<Layer> = None;
    let mut non_finite = 0;
    // Other random numbers for each, so that their errors are independent.
    let by_plan = case.right.first().map(|way| few(case, way)).transpose()?;
    for (seed, way) in (1..).zip(&case.right) {
        if seed > 1 && by_plan.as_ref() == Some(&few(case, way)?) {
            continue;
        }
        let mut run = Run::new(case, way, seed).map_err(|e| fail(way, e))?;
        while run.noise() > noise && run.samples < samples {
            run.go_on(noise, samples);
        }
        let other = reference.get_or_insert_with(|| run.layer.clone());
        right.push(run.verdict(way, other));
        own.get_or_insert_with(|| run.layer.clone());
        non_finite += run.non_finite;
    }
    let (Some(first), Some(own)) = (reference, own) else {
        return Err("a case needs a way".into());
    };
    let samples = PATIENCE * right[0].samples;
    for (seed, way) in (101..).zip(&case.wrong) {
        let mut run = Run::new(case, way, seed).map_err(|e| fail(way, e))?;
        while compare(&run.layer, &first).rms_z < CLEAR && run.samples < samples {
            run.go_on(noise, samples);
        }
        wrong.push(run.verdict(way, &first));
    }
    let differences = match (known, case.step) {
        ([_, known, ..], _) => Some(differences_verdict(known, &own)),
        (_, Some(step)) => Some(differences(case, step, noise, &own)?),
        _ => None,
    };
    Ok(Finding { name: case.name, limit: noise, right, wrong, differences, non_finite })
}

/// Finite differences by as many samples as the noise takes.
fn differences(case: &Case, step: f64, noise: f64, first: &Layer) -> Result<Verdict> {
    let start = Instant::now();
    let mut samples = DIFFERENCES;
    loop {
        let (scene, parameter) = (&case.scene, &case.right[0].parameter);
        let found = Reference::by_differences(scene, parameter, step, samples, 201)?;
        if relative_noise(&found.layer()) > COARSER * noise && samples < MOST_DIFFERENCES {
            samples *= 4;
            continue;
        }
        let seconds = start.elapsed().as_secs_f64();
        return Ok(Verdict { seconds, ..differences_verdict(&found, first) });
    }
}

fn differences_verdict(found: &Reference, first: &Layer) -> Verdict {
    let half = found.layer();
    Verdict {
        way: DIFFERENCES_NAME,
        agreement: compare_biased(first, &half, &found.change()),
        noise: relative_noise(&half),
        samples: found.samples,
        seconds: 0.0,
    }
}

/// What few samples show by a way. Another one with the same bits is the same way by another name.
fn few(case: &Case, way: &Way) -> Result<Vec<Estimate>> {
    let mut run = Run::prepared(case, way, 0).map_err(|e| format!("{}: {e}", way.name))?;
    run.sample(FEW);
    Ok(run.layer.blocks)
}

/// A layer with the blocks in which another sees something.
fn seen(layer: &Layer, by: &Layer) -> Layer {
    let pairs = layer.blocks.iter().zip(&by.blocks);
    let blocks = pairs.filter(|(_, by)| by.mean != Rgb::ZERO).map(|(b, _)| *b).collect();
    Layer { blocks, ..layer.clone() }
}

/// The comparison with finite differences that are off by about a bias.
fn compare_biased(a: &Layer, b: &Layer, bias: &Layer) -> Agreement {
    agreement(&seen(a, b), &seen(b, b), Some(&seen(bias, b)))
}

/// The comparison of blocks in which something is seen: images here have fewer pixels than blocks.
fn compare(a: &Layer, b: &Layer) -> Agreement {
    let seen = |(a, b): &(&Estimate, &Estimate)| a.mean != Rgb::ZERO || b.mean != Rgb::ZERO;
    let (x, y) = a.blocks.iter().zip(&b.blocks).filter(seen).unzip();
    agreement(&Layer { blocks: x, ..a.clone() }, &Layer { blocks: y, ..b.clone() }, None)
}

/// Of the blocks in which something is seen.
fn relative_noise(layer: &Layer) -> f64 {
    seen(layer, layer).relative_noise(None)
}

/// A derivative image as far as it has been computed.
struct Run {
    session: Session,
    start: Instant,
    layer: Layer,
    samples: u32,
    non_finite: u64,
}

impl Run {
    fn new(case: &Case, way: &Way, seed: u64) -> std::result::Result<Self, drt_estimators::Error> {
        let mut run = Self::prepared(case, way, seed)?;
        run.sample(ROUND);
        Ok(run)
    }

    fn prepared(
        case: &Case,
        way: &Way,
        seed: u64,
    ) -> std::result::Result<Self, drt_estimators::Error> {
        let insides = way.insides.clone();
        let settings = Settings { threads: 1, seed, insides, ..Settings::default() };
        let start = Instant::now();
        let session = Session::new(&case.scene, std::slice::from_ref(&way.parameter), &settings)?;
        let layer = session.rendering().image;
        Ok(Self { session, start, layer, samples: 0, non_finite: 0 })
    }

    fn sample(&mut self, count: u32) {
        self.session.run(count, &Unattended);
        self.samples += count;
        let rendering = self.session.rendering();
        self.non_finite = rendering.non_finite;
        self.layer = rendering.derivatives[0].total.clone();
    }

    /// Relative.
    fn noise(&self) -> f64 {
        relative_noise(&self.layer)
    }

    /// Takes as many samples as the noise seen so far says are missing, and a little more, but no
    /// more than twice as many as there are.
    fn go_on(&mut self, noise: f64, most: u32) {
        let left = self.noise() / noise;
        let wanted = f64::from(self.samples) * (1.1 * left * left - 1.0);
        let next = wanted.clamp(f64::from(ROUND), 2.0 * f64::from(self.samples)) as u32;
        self.sample(next.min(most - self.samples));
    }

    fn verdict(&self, way: &Way, first: &Layer) -> Verdict {
        Verdict {
            way: way.name,
            agreement: compare(&self.layer, first),
            noise: self.noise(),
            samples: self.samples,
            seconds: self.start.elapsed().as_secs_f64(),
        }
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
        let right =
            finding.right.iter().chain(&finding.differences).map(|v| ("", v, v.agreement.agrees));
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
