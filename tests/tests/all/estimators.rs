//! Derivatives by the 2019 and the 2023 estimators against those by path space: every cell of the check matrix.
//!
//! The short check runs the representative cells with at most 256 samples per pixel. All of them,
//! for four seconds each, to know what either estimator costs:
//! `cargo test --release -p drt-tests --test all -- --ignored estimators::all:: --nocapture`
//!
//! All that the 2019 theory covers, with the scale of each derivative known to 1 % or for ten minutes each
//! (`DRT_SCALE=0.02 DRT_SECONDS=3000`: to 2 %, or for fifty):
//! `cargo test --release -p drt-tests --test all -- --ignored estimators::covered:: --nocapture`, and `warped::` for the 2023
//! estimator, `both_ends::` for paths from both ends. Images by these against those from the camera:
//! `cargo test --release -p drt-tests --test all -- --ignored estimators::images:: --nocapture`

use std::time::Instant;

use drt_estimators::EstimatorKind::{Radiative, Warped};
use drt_estimators::{Depth, PathSampling, Session, Settings, Unattended, agreement};
use drt_tests::Result;
use drt_tests::matrix::estimators::{Effort, Limit, Method, Pairs, compare};
use drt_tests::matrix::{
    Stage, caged, deforming, lenses, lights, materials, media, riding, surfaces, textures,
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

/// Seconds that each estimator has for a stage, unless `DRT_SECONDS` says otherwise.
fn seconds(default: f64) -> Limit {
    Limit::Seconds(number("DRT_SECONDS", default))
}

/// Another number for other random numbers, `DRT_SEED`.
fn seed() -> u64 {
    number("DRT_SEED", 0.0) as u64
}

fn short() -> Effort {
    Effort { noise: 0.05, scale: 0.0, limit: Limit::Samples(256), seed: seed() }
}

fn costs() -> Effort {
    Effort { noise: 0.01, scale: 0.0, limit: seconds(4.0), seed: seed() }
}

/// Until scales are known to 1 %, or to the part that `DRT_SCALE` says.
fn precise() -> Effort {
    let scale = number("DRT_SCALE", 0.01);
    Effort { noise: 0.01, scale, limit: seconds(600.0), seed: seed() }
}

/// Doubles samples until both images are known to 1/2 %, or time is over.
fn images(stage: &Stage) {
    let run = |sampling, seed| {
        let settings =
            Settings { sampling, seed, max_depth: Depth::OfScene, ..Settings::default() };
        let mut session = Session::new(&stage.scene, &[], &settings).unwrap();
        let (started, most) = (Instant::now(), number("DRT_SECONDS", 4.0));
        let mut spp = 64;
        loop {
            session.run(spp, &Unattended);
            let rendering = session.rendering();
            let noise = rendering.image.relative_noise(None);
            if noise < 0.005 || started.elapsed().as_secs_f64() > most {
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
        mod short {
            $($(#[test] fn $stage() {
                let stage = super::$room::$stage().map(super::Stage::short);
                super::run(stage, &[super::Radiative.into(), super::Warped.into()], super::short());
            })*)*
        }
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
