//! Which estimator finds derivatives with the least work: `EstimatorKind::Auto`.
//!
//! Where nothing moves, all estimators are alike. Elsewhere each one that does not refuse the scene is prepared, a pilot
//! [compares](crate::run::session::choice::comparison) their work, and the run goes on with what was prepared for the one that is chosen.
//!
//! Where lights are points or directions, the estimators share the light as they do when they are asked for by name, and it is these
//! combinations that are compared.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use crate::estimators::{named, warped_alone};
use crate::model::error::Error;
use crate::model::settings::{EstimatorKind, PathSampling, Warp};
use crate::run::session::choice::comparison::{
    Candidate, PART, USUAL, Work, best, cheapest, compare,
};
use crate::run::session::preparation::{Ground, Preparation};
use crate::run::session::term_samples::BATCH;
use crate::world::cache::PreparedCache;

/// More derivatives than these are not sampled by a pilot, whose variances would be too many.
const MOST_PARAMETERS: usize = 256;

/// The fewest paths of a pilot, in batches.
const FEWEST: u32 = 64;

/// The cost of preparing an edge for an estimator, in rays.
const PREPARING: f64 = 8.0;

/// The estimator that is asked for or chosen.
pub(crate) struct Chosen {
    pub(crate) kind: EstimatorKind,
    /// The scene prepared for it.
    pub(crate) preparation: Preparation,
    /// Its name and why it was chosen, where it was.
    pub(crate) why: Option<String>,
}

/// Prepares a scene for the estimator that is asked for, or chooses one.
pub(crate) fn estimator(ground: &Ground<'_>, kept: &mut PreparedCache) -> Result<Chosen, Error> {
    let asked = &ground.settings;
    let named_one = |kind, why: Option<&str>, kept: &mut PreparedCache| {
        let preparation = ground.prepare(named(kind), kept)?;
        let why = why.map(|why| format!("{}: {why}", named(kind).name()));
        Ok(Chosen { kind, preparation, why })
    };
    if asked.estimator != EstimatorKind::Auto || ground.tangents.names.is_empty() {
        return named_one(asked.estimator, None, kept);
    }
    if let Some(why) = warped_alone(ground.scene).filter(|_| ground.moves()) {
        return named_one(EstimatorKind::Warped, Some(why), kept);
    }
    if let Some(why) = needs_no_pilot(ground) {
        return named_one(USUAL, Some(why), kept);
    }
    let both_ends = asked.sampling == PathSampling::Bidirectional;
    let (mut candidates, mut refusal) = (Vec::new(), None);
    let mut consider =
        |kind, candidates: &mut Vec<Candidate>| match ground.prepare(named(kind), kept) {
            Ok(prepared) => candidates.push(Candidate::new(kind, prepared, ground)),
            Err(error) => refusal = refusal.take().or(Some(error)),
        };
    consider(USUAL, &mut candidates);
    if !both_ends {
        consider(EstimatorKind::Radiative, &mut candidates);
    }
    // Other kinds of warps are biased. This estimator is the best one least often, and is not prepared where that costs much.
    let affordable = PART * ground.paths_of_run() * cheapest(&candidates);
    if asked.warp == Warp::Edges && PREPARING * ground.edges() <= affordable {
        consider(EstimatorKind::Warped, &mut candidates);
    }
    let (best, why) = match (&mut candidates[..], refusal) {
        ([], Some(refusal)) => return Err(refusal),
        ([_], _) => (0, String::from("the other estimators refuse this scene")),
        (several, _) => {
            let works = compare(several, ground);
            let ratio =
                |(c, w): (&Candidate, &Work)| format!("{} {:.2}", named(c.kind).name(), w.ratio);
            let compared: Vec<String> = several.iter().zip(&works).map(ratio).collect();
            let compared = compared.join(", ");
            let best = best(several, &works);
            let kept = match several[best].kind == USUAL && works[best].ratio > 1.0 {
                true => "; path-space is kept, since none is clearly better",
                false => "",
            };
            (
                best,
                format!("a pilot measured the work of each, with the least as 1: {compared}{kept}"),
            )
        }
    };
    let Candidate { kind, prepared: preparation, .. } = candidates.swap_remove(best);
    let why = Some(format!("{}: {why}", named(kind).name()));
    Ok(Chosen { kind, preparation, why })
}

/// Why the usual estimator is taken without a pilot, where it is.
fn needs_no_pilot(ground: &Ground<'_>) -> Option<&'static str> {
    let tangents = ground.tangents;
    if tangents.names.len() > MOST_PARAMETERS {
        return Some("there are too many parameters for a pilot");
    }
    if !ground.moves() {
        return Some("nothing moves, and all estimators are alike");
    }
    let short = PART * ground.paths_of_run() < f64::from(FEWEST * BATCH);
    short.then_some("the run is too short for a pilot")
}
