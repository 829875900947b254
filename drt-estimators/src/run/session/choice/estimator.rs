//! Which estimator finds derivatives with the least work: `EstimatorKind::Auto`.
//!
//! Each estimator that does not refuse the scene differentiates a small picture. The work of a derivative by one is the variance of its
//! block means times the cost, and several derivatives count alike:
//!
//! ```text
//! work of k = cost of k × Σ_p variance of p by k / least variance of p by any.
//! ```
//!
//! An estimator that costs many times more than another is left out as soon as a few samples show it.
//!
//! Where lights are points or directions, the estimators share the light as they do when they are asked for by name, and it is these
//! combinations that are compared.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use crate::derivative::tangents::Tangents;
use crate::estimators::named;
use crate::model::error::Error;
use crate::model::scene::Scene;
use crate::model::settings::{EstimatorKind, PathSampling, Settings, Warp};
use crate::run::control::Unattended;
use crate::run::session::Session;
use crate::run::session::choice::{WORTH_IT, cost, pilot, small, variance};
use crate::world::cache::PreparedCache;

/// More derivatives than these are not sampled by a pilot: each would keep films for all of them.
const MOST_PARAMETERS: usize = 256;

/// Longest side of the small picture, in pixels.
const SIDE: f64 = 32.0;

/// Samples of each pixel by which the cost of an estimator is seen.
const FIRST: u32 = 2;

/// Samples of each pixel by which its work is: with fewer, rare samples of edges are often not seen at all.
const SAMPLES: u32 = 32;

/// How many times the least cost an estimator may have to be looked at further.
const MOST_COSTLY: f64 = 8.0;

/// An estimator whose variances are below this part of another's counts as if it had so much.
const LEAST: f64 = 1e-6;

/// An estimator that can be chosen, and the small picture by it.
struct Candidate {
    kind: EstimatorKind,
    session: Session,
}

impl Candidate {
    fn cost(&self) -> f64 {
        cost(&self.session.account.counters)
    }

    fn variances(&self) -> Vec<f64> {
        self.session.rendering().derivatives.iter().map(|d| variance(&d.total)).collect()
    }
}

/// The settings with an estimator in place of `Auto`, and why it was chosen.
pub(crate) fn estimator(
    scene: &Scene,
    tangents: &Tangents,
    settings: &Settings,
    kept: &mut PreparedCache,
) -> Result<(Settings, Option<String>), Error> {
    if settings.estimator != EstimatorKind::Auto {
        return Ok((settings.clone(), None));
    }
    let with = |estimator| Settings { estimator, ..settings.clone() };
    let chosen = |kind, why: &str| Ok((with(kind), Some(format!("{}: {why}", named(kind).name()))));
    let usual = EstimatorKind::PathSpace;
    if tangents.names.is_empty() {
        return Ok((with(usual), None));
    }
    if tangents.names.len() > MOST_PARAMETERS {
        return chosen(usual, "there are too many parameters for a pilot");
    }
    let both_ends = settings.sampling == PathSampling::Bidirectional;
    let kinds = [
        Some(EstimatorKind::PathSpace),
        (!both_ends).then_some(EstimatorKind::Radiative),
        // The others of its kind are biased.
        (settings.warp == Warp::Edges).then_some(EstimatorKind::Warped),
    ];
    let (scene, mut refusal) = (small(scene, settings, SIDE), None);
    let mut candidates = Vec::new();
    for kind in kinds.into_iter().flatten() {
        match Session::prepared(&scene, tangents, &pilot(&with(kind)), kept) {
            Ok(session) => candidates.push(Candidate { kind, session }),
            Err(error) => refusal = refusal.or(Some(error)),
        }
    }
    if let ([], Some(refusal)) = (&candidates[..], refusal) {
        return Err(refusal);
    }
    if let [only] = &candidates[..] {
        return chosen(only.kind, "the other estimators refuse this scene");
    }
    for candidate in &mut candidates {
        candidate.session.run(FIRST, &Unattended);
    }
    let cheapest = candidates.iter().map(Candidate::cost).fold(f64::INFINITY, f64::min);
    candidates.retain(|c| c.cost() <= MOST_COSTLY * cheapest);
    for candidate in &mut candidates {
        candidate.session.run(SAMPLES - FIRST, &Unattended);
    }
    let works = works(&candidates);
    let least = works.iter().copied().fold(f64::INFINITY, f64::min);
    let of_usual = candidates.iter().position(|c| c.kind == usual).map(|i| works[i]);
    let best = match of_usual {
        Some(work) if least >= WORTH_IT * work => usual,
        _ => {
            let best = works.iter().position(|work| *work == least);
            best.map_or(usual, |i| candidates[i].kind)
        }
    };
    let compared = candidates.iter().zip(&works).map(|(c, work)| {
        let ratio = if least > 0.0 { work / least } else { 1.0 };
        format!("{} {ratio:.2}", named(c.kind).name())
    });
    let compared: Vec<String> = compared.collect();
    let why = format!("in a pilot the work was, over the least of all, {}", compared.join(", "));
    chosen(best, &why)
}

/// The work of each candidate.
fn works(candidates: &[Candidate]) -> Vec<f64> {
    let variances: Vec<Vec<f64>> = candidates.iter().map(Candidate::variances).collect();
    let parameters = variances.iter().map(Vec::len).min().unwrap_or(0);
    let mut works = alloc::vec![0.0; candidates.len()];
    for p in 0..parameters {
        let of_parameter = || variances.iter().map(|v| v[p]);
        let largest = of_parameter().fold(0.0, f64::max);
        let least = f64::max(of_parameter().fold(f64::INFINITY, f64::min), LEAST * largest);
        for (work, variance) in works.iter_mut().zip(of_parameter()) {
            // Without any noise, each is as good.
            *work += if largest > 0.0 { f64::max(variance / least, LEAST) } else { 1.0 };
        }
    }
    works.iter_mut().zip(candidates).for_each(|(work, c)| *work *= c.cost());
    works
}
