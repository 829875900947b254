//! Every oracle, value and derivatives, each within four standard errors.
//!
//! The tests that run by default are quick; `--ignored` runs the strict ones. `DRT_ORACLES=FILE`
//! reads another file of the same form.

use drt_tests::judge::{Row, Table, rows};
use drt_tests::measure::{Effort, measure};
use drt_tests::oracle::OracleFile;
use drt_tests::trial::Trial;

/// Runs all cases of a kind and judges them.
fn check(kind: &str, effort: &Effort) {
    let file = OracleFile::read().unwrap();
    let mut all: Vec<Row> = Vec::new();
    for case in file.cases.iter().filter(|c| c.kind == kind) {
        for trial in Trial::of_case(case).unwrap() {
            let measured = measure(&trial, effort).unwrap();
            assert_eq!(measured.non_finite, 0, "{}", trial.name);
            all.extend(rows(&trial, &measured, effort));
        }
    }
    println!("{}", Table(&all));
    assert!(!all.is_empty(), "the file has no case of kind `{kind}`");
    let failing = all.iter().filter(|row| !row.passes()).count();
    assert_eq!(failing, 0, "{failing} of {} numbers fail", all.len());
}

/// Every number to 0.3 %, those near zero to 0.3 % of the largest of their scene.
const STRICT: Effort = Effort { noise: 0.003, near_zero: 0.01, samples: 1 << 30 };

macro_rules! kinds {
    ($($kind:ident: $noise:literal;)*) => {
        $(
            /// To a percent of the scene's largest derivative.
            #[test]
            fn $kind() {
                let quick = Effort { noise: $noise, near_zero: 1.0, samples: 1 << 22 };
                check(stringify!($kind), &quick);
            }
        )*

        mod strict {
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
