//! Choices that the settings leave open, made by rendering small pictures: how paths are found (`PathSampling::Auto`),
//! and which estimator differentiates them (`EstimatorKind::Auto`).
//!
//! Work is variance × cost. The default is left only for a method with less than 0.8 of its work. Costs are counted,
//! not timed, because counts are the same on any machine, with any number of threads and in every run, and so is the
//! choice.

mod estimator;
mod sampling;

pub(crate) use crate::run::session::choice::estimator::estimator;
pub(super) use crate::run::session::choice::sampling::sampling;

use crate::model::rendering::{Counters, Layer};
use crate::model::scene::Scene;
use crate::model::settings::Settings;
use crate::sampling::budget::{BESIDES, LOOKUP};

/// Part of the work of what is usual that something else must not exceed, or noise of the pilot would often choose it
/// for nothing.
const WORTH_IT: f64 = 0.8;

/// Between the seeds of the small pictures and that of the run.
const SEED_STEP: u64 = 0x6a09_e667_f3bc_c909;

/// What an edge that turns a ray costs, in rays.
const TURNING_EDGE: f64 = 1.0;

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

/// What was done, in rays.
fn cost(counters: &Counters) -> f64 {
    let boundary = counters.boundary_samples + counters.border_samples + counters.flux_samples;
    counters.rays as f64
        + LOOKUP * counters.tracking_steps as f64
        + TURNING_EDGE * counters.turning_edges as f64
        + BESIDES * boundary as f64
}
