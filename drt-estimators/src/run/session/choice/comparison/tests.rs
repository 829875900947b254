//! What a few samples tell of a run.

use alloc::vec;

use super::*;
use crate::derivative::tangents;
use crate::derivative::tests::scenes::*;
use crate::estimators::named;
use crate::model::scene::Scene;
use crate::model::settings::{Depth, Settings};
use crate::run::control::Unattended;
use crate::run::session::Session;
use crate::world::cache::PreparedCache;

/// A ball that moves over a floor, in as many pixels as there are blocks.
fn scene() -> Scene {
    let mut scene = surfaces(diffuse(0.7, 0.5, 0.3), diffuse(0.6, 0.5, 0.4));
    let sensor = &mut scene.sensors[0].item.sensor;
    *sensor = sensor.clone().with_film([8, 8]).expect("a film");
    scene
}

/// A candidate with some batches of samples, and a session of what it was prepared for.
fn sampled(settings: &Settings, batches: u32) -> (Candidate, Session) {
    let moves = vec![parameter("ball", 0.0, vec![moves("ball", shift())])];
    let (scene, tangents) = tangents::apply(&scene(), &moves).expect("a valid parameter");
    let (tangents, mut kept) = (tangents.seen_by(0), PreparedCache::default());
    let ground = Ground::new(&scene, &tangents, settings, &mut kept).expect("a valid scene");
    let estimator = named(settings.estimator);
    let mut prepare = || ground.prepare(estimator, &mut kept).expect("a valid scene");
    let mut candidate = Candidate::new(settings.estimator, prepare(), &ground);
    candidate.measure(batches, &ground);
    let preparation = prepare();
    (candidate, Session::of(ground, preparation))
}

#[test]
fn samples_tell_the_variance_of_a_run() {
    // So few boundary samples that each batch of the run has one of each kind, of which there are three and two.
    let cases = [(EstimatorKind::PathSpace, 0.375, 512), (EstimatorKind::Radiative, 0.25, 2048)];
    for (estimator, ratio, passes) in cases {
        let settings = Settings {
            estimator,
            // Passes are so short that threads would spend most of their time waiting for each other.
            threads: 1,
            boundary_ratio: Some(ratio),
            guiding: false,
            antithetic: false,
            // Longer paths have rare samples, whose variance takes many to be seen.
            max_depth: Depth::AtMost(2),
            seed: 3,
            ..Settings::default()
        };
        // Each pass has four samples of each pixel, with random numbers of its own.
        let (candidate, mut session) = sampled(&settings, 2 * passes);
        for _ in 0..passes {
            assert!(session.run(4, &Unattended));
        }
        let rendering = session.rendering();
        let blocks = &rendering.derivatives[0].total.blocks;
        let sum: f64 = blocks.iter().map(|b| (b.stderr * b.stderr).sum()).sum();
        let of_run = sum * f64::from(rendering.spp) / blocks.len() as f64;
        let expected: Vec<f64> = candidate.variances().iter().map(|of_batch| of_batch[0]).collect();
        let (expected, error) = mean_and_error(&expected);
        // The run's variance has an error of its own, which is no larger, as its samples are more.
        let off = |expected: f64| (expected - of_run).abs() / (1.5 * error);
        assert!(error < 0.1 * expected, "{estimator:?} {expected} {error}");
        assert!(off(expected) < 4.0, "{estimator:?} {expected} ({error}), {of_run}");
        // The variance of differences instead of that of samples.
        assert!(off(2.0 * expected) > 4.0, "{estimator:?} {expected} ({error}), {of_run}");
    }
}

#[test]
fn pilots_cost_a_small_part_of_their_run() {
    let part = |expected_spp: u32| {
        let settings = Settings { expected_spp, ..Settings::default() };
        let moves = vec![parameter("ball", 0.0, vec![moves("ball", shift())])];
        let (scene, tangents) = tangents::apply(&scene(), &moves).expect("a valid parameter");
        let (tangents, mut kept) = (tangents.seen_by(0), PreparedCache::default());
        let ground = Ground::new(&scene, &tangents, &settings, &mut kept).expect("a valid scene");
        let kinds = [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped];
        let mut candidates = kinds.map(|kind| {
            let prepared = ground.prepare(named(kind), &mut kept).expect("a valid scene");
            Candidate::new(kind, prepared, &ground)
        });
        let works = compare(&mut candidates, &ground);
        let chosen = &candidates[best(&candidates, &works)];
        let spent: f64 = candidates.iter().map(Candidate::spent).sum();
        spent / (ground.paths_of_run() * chosen.cost())
    };
    for spp in [1 << 9, 1 << 12, 1 << 16] {
        let part = part(spp);
        assert!(part > 0.0 && part <= PART, "{spp}: {part}");
    }
}

/// The mean of some numbers, and its standard error.
fn mean_and_error(numbers: &[f64]) -> (f64, f64) {
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let scatter: f64 = numbers.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (scatter / (count * (count - 1.0))).sqrt())
}
