//! Every oracle, value and derivatives, each within four standard errors.
//!
//! The tests that run by default are quick; `--ignored` runs the strict ones. `DRT_ORACLES=FILE`
//! reads another file of the same form.

use drt_estimators::{EstimatorKind, InteriorMotion};
use drt_tests::cores::on_all_cores;
use drt_tests::judge::{Row, Table, rows};
use drt_tests::measure::{Effort, measure};
use drt_tests::oracle::OracleFile;
use drt_tests::trial::Trial;

/// Runs all cases of a kind and judges them.
fn check(kind: &str, effort: &Effort) {
    judge(&trials(kind), effort);
}

fn trials(kind: &str) -> Vec<Trial> {
    let file = OracleFile::read().unwrap();
    let cases = file.cases.iter().filter(|c| c.kind == kind);
    let trials: Vec<Trial> = cases.flat_map(|c| Trial::of_case(c).unwrap()).collect();
    assert!(!trials.is_empty(), "the file has no case of kind `{kind}`");
    trials
}

fn judge(trials: &[Trial], effort: &Effort) {
    let all: Vec<Row> = on_all_cores(trials, |trial| {
        let measured = measure(trial, effort).unwrap();
        assert_eq!(measured.non_finite, 0, "{}", trial.name);
        let rows = rows(trial, &measured, effort);
        eprintln!("{}", Table(&rows));
        rows
    })
    .concat();
    println!("{}", Table(&all));
    let failing = all.iter().filter(|row| !row.passes()).count();
    assert_eq!(failing, 0, "{failing} of {} numbers fail", all.len());
}

/// Runs the motions of all cases of some kinds with every kind of inside that applies to them.
fn check_insides(kinds: &[&str], effort: &Effort) {
    let insides = [
        ("static", InteriorMotion::Static),
        ("affine", InteriorMotion::Affine),
        ("blend", InteriorMotion::Blend),
        ("tetrahedral", InteriorMotion::Tetrahedral(None)),
        ("mean value", InteriorMotion::MeanValue),
    ];
    let mut all = Vec::new();
    for (name, inside) in insides {
        let plain = kinds.iter().flat_map(|kind| trials(kind));
        let these: Vec<Trial> =
            plain.filter_map(|t| t.with_insides(name, inside.clone())).collect();
        assert!(!these.is_empty(), "nothing moves by {name}");
        all.extend(these);
    }
    judge(&all, effort);
}

/// Every number to 0.3 %, those near zero (less than a twentieth of the largest) to 0.3 % of the
/// largest of their case.
const STRICT: Effort = Effort { noise: 0.003, near_zero: 0.05, of_case: true, samples: 1 << 30 };

/// Cases in which a motion reaches the inside of a medium.
const MOVING: [&str; 8] = [
    "irradiance_polygon_absorbing_medium",
    "absorbing_emitting_box",
    "grid_transmittance",
    "single_scatter_box",
    "volumetric_shadow_ray",
    "volumetric_shadow_pixel",
    "null_interface_two_media",
    "area_light_volumetric_penumbra_pixel",
];

#[test]
fn quickly_by_every_inside() {
    check_insides(&MOVING[1..], &QUICK);
}

/// The cases whose light fits an estimator that goes along rays. In the furnace filled with a medium all derivatives
/// vanish by cancellation along endless paths: there the material form is the one to use.
fn by(estimator: EstimatorKind, effort: &Effort) {
    let file = OracleFile::read().unwrap();
    let cases = file.cases.iter().filter(|c| c.kind != "furnace_closed_enclosure");
    let all = cases.flat_map(|c| Trial::of_case(c).unwrap());
    let trials: Vec<Trial> = all.filter_map(|t| t.by(estimator)).collect();
    assert!(trials.len() > 10, "{} cases", trials.len());
    judge(&trials, effort);
}

/// As well as by path space in the [matrix](drt_tests::matrix); the strict test takes hours.
#[test]
#[ignore = "takes minutes"]
fn to_a_percent_by_radiative() {
    by(EstimatorKind::Radiative, &Effort { noise: 0.01, ..STRICT });
}

#[test]
#[ignore = "takes minutes"]
fn to_a_percent_by_warped() {
    by(EstimatorKind::Warped, &Effort { noise: 0.01, ..STRICT });
}

const QUICK: Effort = Effort { noise: 0.02, near_zero: 1.0, of_case: false, samples: 1 << 20 };

#[test]
fn quickly_by_radiative() {
    by(EstimatorKind::Radiative, &QUICK);
}

#[test]
fn quickly_by_warped() {
    by(EstimatorKind::Warped, &QUICK);
}

macro_rules! kinds {
    ($($kind:ident: $noise:literal;)*) => {
        $(
            /// To a percent of the scene's largest derivative.
            #[test]
            fn $kind() {
                let quick = Effort { noise: $noise, near_zero: 1.0, of_case: false, samples: 1 << 22 };
                check(stringify!($kind), &quick);
            }
        )*

        mod strict {
            /// The inside does not matter (theory sheet §4.1).
            #[test]
            #[ignore = "takes minutes"]
            fn by_every_inside() {
                super::check_insides(&super::MOVING, &super::STRICT);
            }

            #[test]
            #[ignore = "takes minutes"]
            fn by_radiative() {
                super::by(super::EstimatorKind::Radiative, &super::STRICT);
            }

            $(
                #[test]
                #[ignore = "takes minutes"]
                fn $kind() {
                    super::check(stringify!($kind), &super::STRICT);
                }
            )*
        }

        /// No case is passed over.
        #[test]
        fn every_kind_is_known() {
            let known = [$(stringify!($kind)),*];
            for case in OracleFile::read().unwrap().cases {
                assert!(known.contains(&&*case.kind), "{}: unknown kind `{}`", case.id, case.kind);
            }
        }
    };
}

kinds! {
    irradiance_polygon: 0.01;
    irradiance_polygon_occluder_edge: 0.01;
    irradiance_polygon_occluder_inside: 0.01;
    irradiance_polygon_absorbing_medium: 0.01;
    furnace_closed_enclosure: 0.02;
    absorbing_emitting_box: 0.01;
    grid_transmittance: 0.01;
    single_scatter_infinite: 0.01;
    single_scatter_box: 0.01;
    volumetric_shadow_ray: 0.01;
    volumetric_shadow_pixel: 0.01;
    pixel_emissive_triangle: 0.01;
    pixel_floor_shadow: 0.01;
    one_bounce_irradiance: 0.01;
    null_interface_two_media: 0.01;
    area_light_volumetric_penumbra_ray: 0.01;
    area_light_volumetric_penumbra_pixel: 0.01;
    multiple_scattering_slab: 0.01;
}
