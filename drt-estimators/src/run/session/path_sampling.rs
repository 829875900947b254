//! Which paths find an image with the least work: `PathSampling::Auto`.
//!
//! Work is variance × cost. A small picture is rendered with a few samples in either way. The ratio of counted works is within a quarter of what clocks
//! tell.

use alloc::format;
use alloc::string::String;

use crate::derivative::tangents;
use crate::model::error::Error;
use crate::model::rendering::Layer;
use crate::model::scene::Scene;
use crate::model::settings::{PathSampling, Settings};
use crate::run::control::Unattended;
use crate::run::session::Session;
use crate::run::session::term_samples::cost;
use crate::world::World;
use crate::world::cache::PreparedCache;

/// Longest side of the small picture, in pixels.
const SIDE: f64 = 32.0;

/// Samples of each of its pixels.
const SAMPLES: u32 = 32;

/// The part of the work of paths from the camera that paths from both ends must not exceed, or noise of the pilot would often choose them
/// for nothing.
const WORTH_IT: f64 = 0.8;

/// Between the seeds of the small pictures and that of the run.
const SEED_STEP: u64 = 0x6a09_e667_f3bc_c909;

/// The settings with a sampling in place of `Auto`, and why it was chosen.
pub(super) fn path_sampling(
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

/// The scene with a film whose longer side has `side` pixels at most.
fn small(scene: &Scene, settings: &Settings, side: f64) -> Scene {
    let mut scene = scene.clone();
    let sensor = &mut scene.sensors[settings.sensor].item.sensor;
    let film = sensor.film().map(f64::from);
    let part = f64::min(1.0, side / f64::max(film[0], film[1]));
    let small = film.map(|n| f64::max(n * part, 1.0) as u32);
    if let Ok(small) = sensor.with_film(small) {
        *sensor = small;
    }
    scene
}

/// The settings of a pilot.
fn pilot(settings: &Settings) -> Settings {
    Settings {
        seed: settings.seed.wrapping_add(SEED_STEP),
        adaptive: false,
        terms: false,
        ..settings.clone()
    }
}

/// The variances of an image's 8 × 8 blocks, added up.
fn variance(layer: &Layer) -> f64 {
    layer.blocks.iter().map(|b| (b.stderr * b.stderr).sum()).sum()
}
