//! Derivatives against finite differences: scenes × kinds of change.
//!
//! The short check runs one or two cells of every stage. All of them:
//! `cargo test --release -p drt-tests --test check_matrix -- --ignored`

use drt_tests::Result;
use drt_tests::matrix::{Stage, Table, caged, check, deforming, lights, media, riding, surfaces};

fn run(stage: Result<Stage>) {
    let rows = check(&stage.unwrap()).unwrap();
    println!("{}", Table(&rows));
    assert!(!rows.is_empty(), "the stage has no such cells");
    let failing = rows.iter().filter(|row| !row.passes()).count();
    assert_eq!(failing, 0, "{failing} of {} derivatives fail", rows.len());
}

macro_rules! stages {
    ($($room:ident: $($stage:ident)*;)*) => {
        mod short {
            $($(#[test] fn $stage() { super::run(super::$room::$stage().map(super::Stage::short)); })*)*
        }
        mod all {
            $($(#[test] #[ignore = "minutes"] fn $stage() { super::run(super::$room::$stage()); })*)*
        }
    };
}

stages! {
    surfaces: room room_box_filter standing knot gloss near_lamp;
    lights: spot point_and_sun;
    media: fog_box blob still_blob smoke glass dented_glass beam layers sheet ember;
    deforming: wax mean_value_wax still_wax jelly sheared_glass nested touching pulse immersed lantern
        stirred_smoke still_smoke fine_milk fine_glass;
    riding: riding riding_tight riding_inside riding_still riding_tetrahedral riding_mean_value;
    caged: caged_milk caged_glass caged_solid;
}

/// Of any mesh: `DRT_BODY=bunny.obj cargo test --release -p drt-tests --test check_matrix -- --ignored scanned`
#[test]
#[ignore = "needs a mesh, named by DRT_BODY"]
fn scanned_body() {
    let path = std::env::var_os("DRT_BODY").expect("DRT_BODY names an OBJ file");
    run(caged::scanned(path.as_ref()));
}
