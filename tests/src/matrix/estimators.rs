//! Derivatives by one estimator against those by others.

use std::fmt;
use std::time::Instant;

use drt_estimators::{
    Agreement, Derivative, Estimate, EstimatorKind, Layer, PathSampling, Rendering, Session,
    Settings, Term, Unattended, agreement,
};
use drt_motion::Parameter;

use super::scale::{Halves, Scale};
use super::verdict::{MOST_ERRORS, SIGNIFICANT, judge, plus};
use super::{Cell, Fault, Row, Stage};
use crate::Result;
use crate::reference::Reference;

/// Samples per pixel of the first round. There are two at least: they are [compared](Scale) by halves.
const ROUND: u32 = 1 << 6;

/// Samples per pixel that tell whether two methods are the same.
const FEW: u32 = 1 << 4;

/// What each of two estimates may be off by where their scale may be by 1, and a little less: weights that suit
/// both are not the best of either.
const EACH: f64 = 0.95 * std::f64::consts::FRAC_1_SQRT_2;

/// A derivative below this part of the largest one of its image is measured against that one.
const NEAR_ZERO: f64 = 0.05;

/// An estimator of derivatives, and how it finds paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method(pub EstimatorKind, pub PathSampling);

impl Method {
    /// What others are compared with.
    pub const REFERENCE: Self = Self(EstimatorKind::PathSpace, PathSampling::Unidirectional);
    /// By paths from both ends.
    pub const BOTH_ENDS: [Self; 2] =
        [Self::both_ends(EstimatorKind::PathSpace), Self::both_ends(EstimatorKind::Warped)];

    const fn both_ends(kind: EstimatorKind) -> Self {
        Self(kind, PathSampling::Bidirectional)
    }

    /// Prepares each run of a stage, and samples nothing.
    ///
    /// # Errors
    /// When the library rejects the scene or a parameter, or the estimator refuses it.
    pub fn accepts(self, stage: &Stage) -> Result<()> {
        stage.runs().try_for_each(|cells| self.session(stage, &parameters(cells), 0).map(|_| ()))
    }

    fn session(self, stage: &Stage, parameters: &[Parameter], seed: u64) -> Result<Session> {
        let Self(estimator, sampling) = self;
        let settings = Settings {
            threads: 1,
            seed,
            estimator,
            sampling,
            boundary_ratio: (self == Self::REFERENCE)
                .then(|| f64::from(stage.boundary_samples) / f64::from(stage.samples)),
            terms: true,
            insides: stage.insides.clone(),
            ..Settings::default()
        };
        Ok(Session::new(&stage.scene, parameters, &settings)?)
    }
}

impl From<EstimatorKind> for Method {
    fn from(kind: EstimatorKind) -> Self {
        Self(kind, PathSampling::Unidirectional)
    }
}

/// How far to go.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Relative noise of each derivative's block means that is enough.
    pub noise: f64,
    /// Standard error of each [scale](Scale) that is enough instead; 0 where only the former counts.
    pub scale: f64,
    /// Samples per pixel at which to stop if neither is reached.
    pub samples: u32,
    /// Of the random numbers.
    pub seed: u64,
}

/// One derivative by both.
#[derive(Clone, Debug)]
pub struct Pair {
    /// Name of the stage.
    pub stage: &'static str,
    /// Name of the parameter.
    pub parameter: String,
    /// The estimator in question.
    pub method: Method,
    /// The comparison.
    pub agreement: Agreement,
    /// How much larger the one in question is than the other.
    pub scale: Scale,
    /// Noise of the one in question, and of the one it is compared with, as a part of the derivative, or
    /// of the largest one of the image.
    pub noise: [f64; 2],
    /// Variance × time of the one in question over that of the other.
    pub work: f64,
    /// Block means of each term, rms, as a part of the same.
    pub terms: Vec<(Term, f64)>,
    /// What was planted, and the comparisons then.
    pub faults: Vec<Fault>,
    /// Contributions that were no numbers.
    pub non_finite: u64,
    /// The largest share that a single sample of either has in its second moment.
    pub largest_share: f64,
}

impl Pair {
    /// True when both agree, and what is clearly wrong does not.
    #[must_use]
    pub fn passes(&self) -> bool {
        let unseen = |f: &Fault| f.must_be_seen && !f.is_seen;
        let scale = self.scale.z() <= MOST_ERRORS;
        self.agreement.agrees && scale && !self.faults.iter().any(unseen) && self.non_finite == 0
    }
}

/// Compares every derivative of a stage by each of some `methods` with that by path space. Of hundreds of comparisons
/// some exceed by chance what one in a thousand does, and a rare sample may be the first of its kind: what fails is
/// measured once more, by other random numbers and for eight times as long, and the second verdict counts.
///
/// # Errors
/// When the library rejects the scene or a parameter.
pub fn compare(stage: &Stage, methods: &[Method], effort: Effort) -> Result<Vec<Pair>> {
    let seeds = |first: u64| [7, 19].map(|seed| first + effort.seed + seed);
    let mut pairs = compare_once(stage, methods, effort, seeds(0))?;
    for method in methods {
        let again = |pair: &Pair| pair.method == *method && !pair.passes();
        if !pairs.iter().any(again) {
            continue;
        }
        let mut failing = stage.clone();
        failing
            .cells
            .retain(|c| pairs.iter().any(|pair| again(pair) && pair.parameter == c.parameter.name));
        let longer = Effort { samples: 8 * effort.samples, ..effort };
        let second = compare_once(&failing, &[*method], longer, seeds(100))?;
        for pair in pairs.iter_mut().filter(|pair| again(pair)) {
            if let Some(other) = second.iter().find(|s| s.parameter == pair.parameter) {
                *pair = other.clone();
            }
        }
    }
    Ok(pairs)
}

fn compare_once(
    stage: &Stage,
    methods: &[Method],
    effort: Effort,
    seeds: [u64; 2],
) -> Result<Vec<Pair>> {
    let mut pairs = Vec::new();
    for cells in stage.runs() {
        let parameters = parameters(cells);
        let run = |method, seed| sample(stage, &parameters, method, seed, effort);
        // Other random numbers, so that the errors are independent.
        let reference = run(Method::REFERENCE, seeds[0])?;
        for method in methods {
            let own = run(*method, seeds[1])?;
            pairs.extend(pairs_of(stage.name, *method, &own, &reference));
        }
    }
    Ok(pairs)
}

/// A stage by several estimators, each of which was sampled once.
#[derive(Clone, Debug, Default)]
pub struct Examined {
    /// Each against finite differences.
    pub rows: Vec<Row>,
    /// Others against path space.
    pub pairs: Vec<Pair>,
}

/// Samples a stage by path space, as long as the stage says, and by each of some `methods`, and judges all by finite differences
/// and the `methods` also by path space. What fails is [measured once more](compare). A method that is the same as one before it is passed over.
///
/// # Errors
/// When the library rejects the scene or a parameter.
pub fn examine(
    stage: &Stage,
    references: &[Reference],
    methods: &[Method],
    effort: Effort,
) -> Result<Examined> {
    let mut found = Examined::default();
    let mut number = 0;
    for cells in stage.runs() {
        let references = &references[number..number + cells.len()];
        number += cells.len();
        let parameters = parameters(cells);
        let rows = |method: Method, sampled: &Sampled| -> Vec<Row> {
            let cells = cells.iter().enumerate().zip(references);
            let of =
                |((k, cell), reference)| judge(stage.name, method, (cell, k), sampled, reference);
            cells.map(of).collect()
        };
        let longest = Effort { noise: 0.0, scale: 0.0, samples: stage.samples, ..effort };
        let run = |seed| sample(stage, &parameters, Method::REFERENCE, seed, longest);
        let path_space = run(effort.seed + 7)?;
        found.rows.extend(rows(Method::REFERENCE, &path_space));
        for (k, method) in methods.iter().enumerate() {
            if is_among(*method, &methods[..k], stage, &parameters)? {
                continue;
            }
            let run = |effort: Effort| -> Result<(Vec<Row>, Vec<Pair>)> {
                let own = sample(stage, &parameters, *method, effort.seed + 19, effort)?;
                Ok((rows(*method, &own), pairs_of(stage.name, *method, &own, &path_space)))
            };
            let (mut rows, mut pairs) = run(effort)?;
            if !(rows.iter().all(Row::passes) && pairs.iter().all(Pair::passes)) {
                let (seed, samples) = (effort.seed + 100, 8 * effort.samples);
                (rows, pairs) = run(Effort { seed, samples, ..effort })?;
            }
            found.rows.extend(rows);
            found.pairs.extend(pairs);
        }
    }
    Ok(found)
}

/// Whether a method is the same as one of some others: where lights are points or directions, one estimator may leave all that it could do
/// otherwise to terms that the other has, too, and samples have the same bits by both.
fn is_among(
    method: Method,
    others: &[Method],
    stage: &Stage,
    parameters: &[Parameter],
) -> Result<bool> {
    let by = |method: Method| -> Result<Vec<Vec<Estimate>>> {
        let mut session = method.session(stage, parameters, 0)?;
        session.run(FEW, &Unattended);
        Ok(session.rendering().derivatives.into_iter().map(|d| d.total.pixels).collect())
    };
    for other in others {
        if by(method)? == by(*other)? {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The comparisons of all derivatives that two estimators have sampled.
fn pairs_of(stage: &'static str, method: Method, own: &Sampled, reference: &Sampled) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (k, (a, b)) in own.all.derivatives.iter().zip(&reference.all.derivatives).enumerate() {
        let size = b.total.rms_value();
        let part = reference.part(k);
        let noise = [&a.total, &b.total].map(|l| l.relative_noise(Some(size)) * part);
        let terms: Vec<(Term, f64)> =
            a.terms.iter().map(|(t, l)| (*t, l.rms_value() / size * part)).collect();
        let plant = |((term, part), (_, layer)): (&(Term, f64), &(Term, Layer))| {
            (*part >= SIGNIFICANT).then(|| {
                let found = agreement(&plus(&a.total, -2.0, layer), &b.total, None);
                Fault {
                    term: *term,
                    factor: -1.0,
                    rms_z: found.rms_z,
                    scale_z: 0.0,
                    is_seen: !found.agrees,
                    // A term of the wrong sign is off by twice its size.
                    must_be_seen: 2.0 * part > 3.0 * noise[0].hypot(noise[1]),
                }
            })
        };
        pairs.push(Pair {
            stage,
            parameter: a.name.clone(),
            method,
            agreement: agreement(&a.total, &b.total, None),
            scale: Scale::new(own.halves(k), reference.halves(k)) * part,
            noise,
            work: (noise[0] / noise[1]).powi(2) * own.seconds / reference.seconds,
            faults: terms.iter().zip(&a.terms).filter_map(plant).collect(),
            terms,
            non_finite: own.all.non_finite,
            largest_share: f64::max(a.total.tail.share(), b.total.tail.share()),
        });
    }
    pairs
}

/// What has been sampled.
pub(super) struct Sampled {
    /// From the first half of the samples.
    pub(super) first: Rendering,
    /// From all of them.
    pub(super) all: Rendering,
    pub(super) seconds: f64,
}

impl Sampled {
    fn is_enough(&self, effort: Effort) -> bool {
        let enough = EACH * effort.scale;
        let known = |k| Scale::noise(self.halves(k)) * self.part(k) <= enough;
        let clear = |(k, d): (usize, &Derivative)| {
            d.total.relative_noise(None) * self.part(k) <= effort.noise || known(k)
        };
        self.all.derivatives.iter().enumerate().all(clear)
    }

    /// 1, or what it is of the image's largest derivative where it is near zero.
    fn part(&self, parameter: usize) -> f64 {
        let size = |d: &Derivative| d.total.rms_value();
        let largest = self.all.derivatives.iter().map(size).fold(0.0, f64::max);
        let part = size(&self.all.derivatives[parameter]) / largest;
        if part < NEAR_ZERO { part } else { 1.0 }
    }

    fn halves(&self, parameter: usize) -> Halves<'_> {
        let [first, all] = [&self.first, &self.all].map(|r| &r.derivatives[parameter].total);
        Halves { first, all }
    }
}

/// Samples until every derivative is precise enough, or the limit is reached.
fn sample(
    stage: &Stage,
    parameters: &[Parameter],
    method: Method,
    seed: u64,
    effort: Effort,
) -> Result<Sampled> {
    let mut session = method.session(stage, parameters, seed)?;
    let start = Instant::now();
    session.run(ROUND, &Unattended);
    let mut first = session.rendering();
    loop {
        // As many again.
        session.run(first.spp, &Unattended);
        let (all, seconds) = (session.rendering(), start.elapsed().as_secs_f64());
        let is_last = 2 * all.spp > effort.samples;
        let sampled = Sampled { first, all, seconds };
        if sampled.is_enough(effort) || is_last {
            return Ok(sampled);
        }
        first = sampled.all;
    }
}

fn parameters(cells: &[Cell]) -> Vec<Parameter> {
    cells.iter().map(|c| c.parameter.clone()).collect()
}

/// Pairs as a table for a reader of test output.
#[derive(Clone, Copy, Debug)]
pub struct Pairs<'a>(pub &'a [Pair]);

impl fmt::Display for Pairs<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n{:<54}  rms z  max z  limit  noise   path            scale    work  terms; faults and their rms z",
            ""
        )?;
        for pair in self.0 {
            let Method(kind, sampling) = pair.method;
            let ends = if sampling == PathSampling::Bidirectional { ", both ends" } else { "" };
            let name = format!("{}: {}, {kind:?}{ends}", pair.stage, pair.parameter);
            let a = &pair.agreement;
            write!(f, "{name:<54} {:>6.2} {:>6.2} {:>6.2}", a.rms_z, a.max_z, a.limit)?;
            for noise in pair.noise {
                write!(f, " {:>5.1}%", 100.0 * noise)?;
            }
            let Scale { off, stderr } = pair.scale;
            write!(f, "  {:>+6.2} ± {:>5.2}%", 100.0 * off, 100.0 * stderr)?;
            write!(f, " {:>7.3} ", pair.work)?;
            for (term, part) in pair.terms.iter().filter(|(_, part)| *part >= 5e-3) {
                write!(f, " {} {part:.2}", term.name())?;
            }
            for fault in &pair.faults {
                let unclear = if fault.must_be_seen { "" } else { " (in noise)" };
                write!(f, "; {} × -1: {:.1}{unclear}", fault.term.name(), fault.rms_z)?;
            }
            write!(f, "; largest sample {:.0} %", 100.0 * pair.largest_share)?;
            writeln!(f, "{}", if pair.passes() { "" } else { "  <<< FAILS" })?;
        }
        Ok(())
    }
}
