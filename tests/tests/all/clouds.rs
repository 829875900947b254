//! Clouds with empty voxels, in every border and by every light, at rest and in motion, by all estimators against finite differences:
//! `cargo test --release -p drt-tests --test all -- --ignored clouds:: --nocapture`
//!
//! One of them is also a stage of the check matrix.

use drt_estimators::EstimatorKind::{PathSpace, Radiative, Warped};
use drt_estimators::PathSampling::Bidirectional;
use drt_tests::Result;
use drt_tests::matrix::clouds::{Border, Light, cloud};
use drt_tests::matrix::estimators::{Effort, Method};
use drt_tests::matrix::reference;
use drt_tests::reference::Reference;

use crate::check_matrix::judge;

/// Samples over those of the check matrix.
const LONGER: u32 = 4;

fn check(border: Border, light: Light) {
    let mut stage = cloud(border, light).unwrap();
    // Scales of derivatives are known to 1 to 3 % by so many.
    stage.samples *= LONGER;
    stage.cells.iter_mut().for_each(|cell| cell.samples *= LONGER);
    let effort = Effort { noise: 0.01, scale: 0.02, samples: stage.samples, seed: 0 };
    let references: Result<Vec<Reference>> =
        stage.cells.iter().map(|cell| reference::short(&stage, cell)).collect();
    let methods = [Radiative.into(), Warped.into(), Method(PathSpace, Bidirectional)];
    judge(&stage, &references.unwrap(), &methods, effort);
}

macro_rules! clouds {
    ($($border:ident $name:ident;)*) => {
        $(mod $name {
            use super::{Border, Light, check};

            #[test]
            #[ignore = "minutes"]
            fn even_sky() {
                check(Border::$border, Light::Even);
            }

            #[test]
            #[ignore = "minutes"]
            fn sky() {
                check(Border::$border, Light::Sky);
            }

            #[test]
            #[ignore = "minutes"]
            fn lamp_above() {
                check(Border::$border, Light::LampAbove);
            }

            #[test]
            #[ignore = "minutes"]
            fn lamp_inside() {
                check(Border::$border, Light::LampInside);
            }

            #[test]
            #[ignore = "minutes"]
            fn point() {
                check(Border::$border, Light::Point);
            }
        })*
    };
}

clouds! {
    Cube in_a_cube;
    Sphere in_a_sphere;
    Ring in_a_ring;
}
