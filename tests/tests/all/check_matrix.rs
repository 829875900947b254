//! Derivatives against finite differences: scenes × kinds of change.
//!
//! The short check runs one or two cells of every stage. All of them:
//! `cargo test --release -p drt-tests --test all -- --ignored check_matrix::`

use drt_tests::Result;
use drt_tests::matrix::{
    Stage, Table, caged, check, deforming, lenses, lights, materials, media, riding, still,
    surfaces, textures,
};

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

drt_tests::every_stage!(stages);

/// Of any mesh: `DRT_BODY=bunny.obj cargo test --release -p drt-tests --test all -- --ignored check_matrix::scanned`
#[test]
#[ignore = "needs a mesh, named by DRT_BODY"]
fn scanned_body() {
    let path = std::env::var_os("DRT_BODY").expect("DRT_BODY names an OBJ file");
    run(caged::scanned(path.as_ref()));
}

/// Parallel rays, which not every estimator has derivatives of; the others refuse them.
mod through {
    use super::{Stage, lenses, run};

    #[test]
    fn parallel_rays() {
        run(lenses::parallel_rays().map(Stage::short));
    }

    #[test]
    #[ignore = "minutes"]
    fn all() {
        run(lenses::parallel_rays());
    }
}

/// Surfaces past which only what moves nothing is differentiated.
mod past {
    use super::{Stage, run, still};

    #[test]
    fn mirrors() {
        run(still::mirrors().map(Stage::short));
    }

    #[test]
    fn veiled() {
        run(still::veiled().map(Stage::short));
    }

    #[test]
    #[ignore = "minutes"]
    fn all() {
        run(still::mirrors());
        run(still::veiled());
    }
}
