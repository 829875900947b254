//! Which paths find an image with the least work: `PathSampling::Auto`.
//!
//! A small picture is rendered with a few samples in either way. The ratio of counted works is within a quarter of what clocks
//! tell.

use alloc::format;
use alloc::string::String;

use crate::derivative::tangents;
use crate::model::error::Error;
use crate::model::scene::Scene;
use crate::model::settings::{PathSampling, Settings};
use crate::run::control::Unattended;
use crate::run::session::Session;
use crate::run::session::choice::{WORTH_IT, cost, pilot, small, variance};
use crate::world::World;
use crate::world::cache::PreparedCache;

/// Longest side of the small picture, in pixels.
const SIDE: f64 = 32.0;

/// Samples of each of its pixels.
const SAMPLES: u32 = 32;

/// The settings with a sampling in place of `Auto`, and why it was chosen.
pub(in super::super) fn sampling(
    world: &World,
    scene: &Scene,
    settings: &Settings,
    derivatives: bool,
    kept: &mut PreparedCache,
) -> Result<(Settings, Option<String>), Error> {
    let with = |sampling| Settings { sampling, ..settings.clone() };
    if settings.sampling != PathSampling::Auto {
        return Ok((settings.clone(), None));
    }
    let plain = with(PathSampling::Unidirectional);
    let without = |why: &str| Ok((plain.clone(), Some(format!("unidirectional: {why}"))));
    if derivatives {
        return without(
            "`auto` chooses for images; derivatives have paths from both ends where these are asked for",
        );
    }
    if world.hides_emitters {
        return without("light paths do not know what is hidden");
    }
    if scene.first_straight().is_some() {
        return without("light paths do not know what light goes straight through");
    }
    if world.max_depth < 2 || !world.lights.start_paths() {
        return without("there are no light paths to join");
    }
    let works = [PathSampling::Unidirectional, PathSampling::Bidirectional]
        .map(|sampling| work(scene, &with(sampling), kept));
    let [one, both] = works;
    let (one, both) = (one?, both?);
    // Without any noise, the first is as good.
    let ratio = if one > 0.0 { both / one } else { 1.0 };
    let (sampling, name) = match ratio < WORTH_IT {
        true => (PathSampling::Bidirectional, "bidirectional"),
        false => (PathSampling::Unidirectional, "unidirectional"),
    };
    let why = format!(
        "{name}: in a pilot, paths from both ends took {ratio:.2} of the work of those from the camera"
    );
    Ok((with(sampling), Some(why)))
}

/// The work of a small picture.
fn work(scene: &Scene, settings: &Settings, kept: &mut PreparedCache) -> Result<f64, Error> {
    let (scene, at_rest) = tangents::apply(&small(scene, settings, SIDE), &[])?;
    let mut session = Session::prepared(&scene, &at_rest, &pilot(settings), kept)?;
    session.run(SAMPLES, &Unattended);
    Ok(variance(&session.rendering().image) * cost(&session.account.counters))
}
