//! Derivatives by the 2019 and the 2023 estimators against those by path space: every cell of the check matrix, whose short check
//! is beside that of finite differences.
//!
//! All cells with as many samples per pixel as `DRT_SAMPLES` says, to know what either estimator costs:
//! `cargo test --release -p drt-tests --test all -- --ignored estimators::all:: --nocapture`
//!
//! All that the 2019 theory covers, with the scale of each derivative known to 1 % or to what `DRT_SAMPLES` gives
//! (`DRT_SCALE=0.02`: to 2 %):
//! `cargo test --release -p drt-tests --test all -- --ignored estimators::covered:: --nocapture`, and `warped::` for the 2023
//! estimator, `both_ends::` for paths from both ends. Images by these against those from the camera:
//! `cargo test --release -p drt-tests --test all -- --ignored estimators::images:: --nocapture`

use std::time::Instant;

use drt_estimators::EstimatorKind::{Radiative, Warped};
use drt_estimators::{Depth, PathSampling, Session, Settings, Unattended, agreement};
use drt_tests::Result;
use drt_tests::matrix::estimators::{Effort, Method, Pairs, compare};
use drt_tests::matrix::{
    Stage, caged, clouds, deforming, lenses, lights, materials, media, riding, surfaces, textures,
};

fn run(stage: Result<Stage>, methods: &[Method], effort: Effort) {
    let pairs = compare(&stage.unwrap(), methods, effort).unwrap();
    println!("{}", Pairs(&pairs));
    assert!(!pairs.is_empty(), "the stage has no such cells");
    let failing = pairs.iter().filter(|pair| !pair.passes()).count();
    assert_eq!(failing, 0, "{failing} of {} derivatives fail", pairs.len());
}

fn number(variable: &str, default: f64) -> f64 {
    std::env::var(variable).ok().and_then(|s| s.parse().ok()).unwrap_or(default)
}

/// Most samples per pixel, unless `DRT_SAMPLES` says otherwise.
fn samples(default: u32) -> u32 {
    number("DRT_SAMPLES", f64::from(default)) as u32
}

/// Another number for other random numbers, `DRT_SEED`.
fn seed() -> u64 {
    number("DRT_SEED", 0.0) as u64
}

fn costs() -> Effort {
    Effort { noise: 0.01, scale: 0.0, samples: samples(1 << 11), seed: seed() }
}

/// Until scales are known to 1 %, or to the part that `DRT_SCALE` says.
fn precise() -> Effort {
    let scale = number("DRT_SCALE", 0.01);
    Effort { noise: 0.01, scale, samples: samples(1 << 18), seed: seed() }
}

/// Doubles samples until both images are known to 1/2 %, or samples are spent.
fn images(stage: &Stage) {
    let run = |sampling, seed| {
        let settings =
            Settings { sampling, seed, max_depth: Depth::OfScene, ..Settings::default() };
        let mut session = Session::new(&stage.scene, &[], &settings).unwrap();
        let started = Instant::now();
        let mut spp = 64;
        loop {
            session.run(spp, &Unattended);
            let rendering = session.rendering();
            let noise = rendering.image.relative_noise(None);
            if noise < 0.005 || 2 * rendering.spp > samples(1 << 14) {
                return (rendering, noise, started.elapsed().as_secs_f64());
            }
            spp = rendering.spp;
        }
    };
    let (one, one_noise, one_seconds) = run(PathSampling::Unidirectional, 1);
    let (both, both_noise, both_seconds) = run(PathSampling::Bidirectional, 2);
    let found = agreement(&both.image, &one.image, None);
    println!(
        "{:18} rms z {:5.2} max z {:5.2} noise {:.4} {:.4}  work {:.2}",
        stage.name,
        found.rms_z,
        found.max_z,
        one_noise,
        both_noise,
        (both_noise / one_noise).powi(2) * both_seconds / one_seconds,
    );
    assert!(found.agrees && both.non_finite == 0);
}

macro_rules! stages {
    ($($room:ident: $($stage:ident)*;)*) => {
        mod all {
            $($(#[test] #[ignore = "minutes"] fn $stage() {
                super::run(super::$room::$stage(), &[super::Radiative.into()], super::costs());
            })*)*
        }
        mod covered {
            $($(#[test] #[ignore = "hours"] fn $stage() {
                let stage = super::$room::$stage().map(super::Stage::in_extended_light);
                super::run(stage, &[super::Radiative.into()], super::precise());
            })*)*
        }
        mod warped {
            $($(#[test] #[ignore = "hours"] fn $stage() {
                super::run(super::$room::$stage(), &[super::Warped.into()], super::precise());
            })*)*
        }
        mod both_ends {
            $($(#[test] #[ignore = "hours"] fn $stage() {
                super::run(super::$room::$stage(), &super::Method::BOTH_ENDS, super::precise());
            })*)*
        }
        mod images {
            $($(#[test] #[ignore = "minutes"] fn $stage() {
                super::images(&super::$room::$stage().unwrap());
            })*)*
        }
    };
}

drt_tests::every_stage!(stages);
