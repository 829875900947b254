//! Shards of a run, merged, are the run in one piece, to the bit.

use crate::common::pairing::targets;
use crate::common::*;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::{
    EstimatorKind, PathSampling, Rendering, Scene, Session, Settings, Shard, ShardError, ShardSums,
    Unattended, gradient_in_batches,
};
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::Parameter;

const SPP: u32 = 32;

fn case() -> (Scene, Vec<Parameter>) {
    let scene = fog();
    let parameters = vec![
        parameter("ball", 0.0, vec![moves("ball", wobble(&scene, "ball", 1))]),
        parameter("blob", 0.0, vec![moves("blob", shift()), changes("thin", "albedo", grey(0.3))]),
    ];
    (scene, parameters)
}

fn settings(estimator: EstimatorKind, adaptive: bool) -> Settings {
    Settings { estimator, adaptive, terms: true, threads: 2, seed: 5, ..Settings::default() }
}

fn shard(session: &mut Session, index: u32, count: u32, seed: u64) -> ShardSums {
    let shard = Shard::new(index, count).expect("one of them");
    let sums = session.run_shard(SPP, seed, shard, &Unattended).expect("a valid run");
    sums.expect("not cancelled")
}

/// All numbers of all images, as bits.
fn bits(r: &Rendering) -> Vec<u64> {
    let of = |d: &drt_estimators::Derivative| {
        let terms = d.terms.iter().map(|(_, l)| l.clone());
        [d.total.clone()].into_iter().chain(terms).collect::<Vec<_>>()
    };
    let layers = [r.image.clone()].into_iter().chain(r.derivatives.iter().flat_map(of));
    let estimates = layers
        .flat_map(|l| l.pixels.into_iter().chain(l.blocks).chain([l.total]).collect::<Vec<_>>());
    let numbers = estimates.flat_map(|e| [e.mean, e.stderr]).flat_map(Rgb::to_array);
    numbers.map(f64::to_bits).collect()
}

/// Merges shards of a run, and asks for the bits of the run in one piece, and for others without one of them.
fn same_bits(scene: &Scene, parameters: &[Parameter], settings: &Settings) {
    let name = (settings.estimator, settings.sampling, settings.adaptive);
    let mut session = Session::new(scene, parameters, settings).expect("a valid scene");
    session.run(SPP, &Unattended);
    let whole = session.rendering();
    for count in [1, 3, 8] {
        let mut shards: Vec<_> =
            (1..=count).rev().map(|i| shard(&mut session, i, count, 5)).collect();
        let merged = ShardSums::merge(&shards).expect("all of one run");
        assert!(merged.missing.is_empty() && merged.rendering.complete);
        assert_eq!(merged.rendering.spp, whole.spp);
        assert!(bits(&merged.rendering) == bits(&whole), "{name:?} in {count}");
        if !settings.adaptive {
            assert_eq!(merged.rendering.counters, whole.counters);
        }
        if count > 1 {
            // A sample that is not there is missed.
            shards.pop();
            let rest = ShardSums::merge(&shards);
            assert!(settings.adaptive || bits(&rest.expect("enough").rendering) != bits(&whole));
        }
    }
}

#[test]
fn merged_shards_are_the_run_in_one_piece() {
    let (scene, parameters) = case();
    for estimator in [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped] {
        for adaptive in [false, true] {
            same_bits(&scene, &parameters, &settings(estimator, adaptive));
        }
    }
}

/// Paths that count for many pixels, and those of light, which reach any.
#[test]
fn splatted_shards_are_the_image_in_one_piece() {
    let (mut scene, parameters) = case();
    let view = [vec3(0.4, 0.8, 4.2), Vec3::ZERO, Vec3::Y];
    for adaptive in [false, true] {
        for (kind, splatting) in [(FilterKind::TENT, true), (FilterKind::BOX, false)] {
            let filter = Filter::new(kind).expect("a valid filter");
            // Tiles in the midst of rows, and more than one of them.
            let sensor = Sensor::look_at(view, Lens::with_fov(40.0), [21, 17], filter);
            scene.sensors[0].item.sensor = sensor.expect("a valid camera");
            let mut settings = settings(EstimatorKind::PathSpace, adaptive);
            let plan = |settings: &Settings| {
                let session = Session::new(&scene, &[], settings).expect("a valid scene");
                session.plan().clone()
            };
            assert_eq!(plan(&settings).splatting, splatting);
            if splatting {
                same_bits(&scene, &[], &settings);
                same_bits(&scene, &parameters, &settings);
            }
            settings.sampling = PathSampling::Bidirectional;
            assert!(plan(&settings).splatting && plan(&settings).bidirectional);
            same_bits(&scene, &[], &settings);
        }
    }
}

/// Errors are those of the samples that there are, and they tell the truth.
#[test]
fn missing_shards_make_wider_errors() {
    let (scene, parameters) = case();
    let settings = settings(EstimatorKind::PathSpace, false);
    let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
    let all: Vec<_> = (1..=8).map(|i| shard(&mut session, i, 8, 5)).collect();
    let whole = ShardSums::merge(&all).expect("all of one run").rendering;
    let some = ShardSums::merge(&[all[1].clone(), all[6].clone()]).expect("enough");
    assert_eq!(some.missing, [1, 3, 4, 5, 6, 8]);
    assert!(!some.rendering.complete);
    assert_eq!(some.rendering.spp, SPP / 4);
    session.restart(77);
    session.run(16 * SPP, &Unattended);
    let reference = session.rendering();
    let pairs = |r: &Rendering| {
        let own = [&r.image, &r.derivatives[0].total, &r.derivatives[1].total];
        let best =
            [&reference.image, &reference.derivatives[0].total, &reference.derivatives[1].total];
        let (mut squares, mut errors, mut n) = (0.0, 0.0, 0.0);
        for (a, b) in own.iter().zip(best) {
            for (a, b) in a.blocks.iter().zip(&b.blocks) {
                let error = a.stderr.g.hypot(b.stderr.g);
                if error > 0.0 {
                    squares += ((a.mean.g - b.mean.g) / error).powi(2);
                    errors += a.stderr.g;
                    n += 1.0;
                }
            }
        }
        (f64::sqrt(squares / n), errors)
    };
    let ((z, error), (_, least)) = (pairs(&some.rendering), pairs(&whole));
    assert!(z < 1.3 && error > 1.3 * least, "{z} {error} {least}");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let (scene, parameters) = case();
    let settings = settings(EstimatorKind::PathSpace, false);
    let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
    let [a, b, foreign, other] = [(1, 3, 5), (2, 3, 5), (3, 3, 6), (2, 4, 5)]
        .map(|(i, n, seed)| shard(&mut session, i, n, seed));
    let merge = |shards: &[&ShardSums]| {
        ShardSums::merge(&shards.iter().map(|s| (*s).clone()).collect::<Vec<_>>())
            .map(|m| m.missing)
    };
    assert_eq!(merge(&[]), Err(ShardError::None));
    assert_eq!(merge(&[&a, &b]), Ok(vec![3]));
    assert_eq!(merge(&[&a, &b, &a]), Err(ShardError::Twice(a.shard())));
    for (foreign, with) in [(&foreign, &a), (&other, &a)] {
        assert_eq!(merge(&[with, foreign]), Err(ShardError::Foreign(foreign.shard())));
    }
    let shard = Shard::new(1, 33).expect("one of them");
    let error = session.run_shard(SPP, 5, shard, &Unattended).expect_err("too many");
    assert!(error.to_string().contains("33"), "{error}");
}

#[test]
fn gradients_are_sums_of_batches() {
    let (scene, parameters) = case();
    let wanted: Vec<_> = targets(&scene, &parameters[0]);
    let settings = settings(EstimatorKind::PathSpace, false);
    let adjoint: Vec<Rgb> =
        (0..FILM[0] * FILM[1]).map(|i| Rgb::splat(f64::from(i % 7) - 3.0)).collect();
    let numbers = |shard: Option<Shard>| {
        let mut batches = Vec::new();
        let mut each = |batch: drt_estimators::GradientBatch| {
            batches.push((batch.number, batch.pixels.shapes, batch.boundary.shapes));
        };
        let done = gradient_in_batches(
            &scene,
            &wanted,
            &settings,
            SPP,
            &adjoint,
            shard,
            &Unattended,
            &mut each,
        );
        assert!(matches!(done, Ok(true)));
        batches
    };
    let whole = numbers(None);
    let parts: Vec<_> = (1..=5).flat_map(|i| numbers(Shard::new(i, 5))).collect();
    assert!(whole == parts && whole.len() >= 16);
}
