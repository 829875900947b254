//! Derivatives against finite differences: scenes × kinds of change × estimators.
//!
//! The short check samples one or two cells of every stage once by each estimator, and judges them by the stored finite
//! differences of long runs, and by each other. All cells by path space, against finite differences of their own:
//! `cargo test --release -p drt-tests --test all -- --ignored check_matrix::`

use drt_estimators::EstimatorKind::{Radiative, Warped};
use drt_tests::Result;
use drt_tests::matrix::estimators::{Effort, Method, Pairs, examine};
use drt_tests::matrix::reference::{self, stored};
use drt_tests::matrix::{
    Stage, Table, caged, clouds, deforming, lenses, lights, materials, media, riding, still,
    surfaces, textures,
};
use drt_tests::reference::Reference;

/// How far estimators other than path space go, whose samples are the stage's.
const EFFORT: Effort = Effort { noise: 0.05, scale: 0.0, samples: 256, seed: 0 };

pub(crate) fn judge(stage: &Stage, references: &[Reference], methods: &[Method], effort: Effort) {
    let found = examine(stage, references, methods, effort).unwrap();
    println!("{}{}", Table(&found.rows), Pairs(&found.pairs));
    assert!(!found.rows.is_empty(), "the stage has no such cells");
    let failing = found.rows.iter().filter(|row| !row.passes()).count();
    let disagreeing = found.pairs.iter().filter(|pair| !pair.passes()).count();
    assert_eq!(failing, 0, "{failing} of {} derivatives fail", found.rows.len());
    assert_eq!(disagreeing, 0, "{disagreeing} of {} estimates disagree", found.pairs.len());
}

/// The representative cells against stored references.
fn short(stage: Result<Stage>, methods: &[Method]) {
    let stage = stage.unwrap().short();
    judge(&stage, &stored(&stage).unwrap_or_else(|e| panic!("{e}")), methods, EFFORT);
}

/// All cells by path space, against finite differences of now.
fn long(stage: Result<Stage>) {
    let stage = stage.unwrap();
    let of = |cell| reference::short(&stage, cell);
    let references: Result<Vec<Reference>> = stage.cells.iter().map(of).collect();
    judge(&stage, &references.unwrap(), &[], EFFORT);
}

macro_rules! stages {
    ($($room:ident: $($stage:ident)*;)*) => {
        mod short {
            $($(#[test] fn $stage() {
                super::short(super::$room::$stage(), &[super::Radiative.into(), super::Warped.into()]);
            })*)*
        }
        mod all {
            $($(#[test] #[ignore = "minutes"] fn $stage() { super::long(super::$room::$stage()); })*)*
        }
    };
}

drt_tests::every_stage!(stages);

/// Checks the derivatives of any mesh: `DRT_BODY=bunny.obj cargo test --release -p drt-tests --test all -- --ignored check_matrix::scanned`
#[test]
#[ignore = "needs a mesh, named by DRT_BODY"]
fn scanned_body() {
    let path = std::env::var_os("DRT_BODY").expect("DRT_BODY names an OBJ file");
    long(caged::scanned(path.as_ref()));
}

/// Parallel rays, which not every estimator has derivatives of; the others refuse them.
mod through {
    use super::{lenses, long, short};

    #[test]
    fn parallel_rays() {
        short(lenses::parallel_rays(), &[]);
    }

    #[test]
    #[ignore = "minutes"]
    fn all() {
        long(lenses::parallel_rays());
    }
}

/// What jumps under points which slide over surfaces: path space has points that do not, and rays of warped turn with lines of textures.
mod jumping {
    use super::{Warped, long, short, textures};

    #[test]
    fn tiles() {
        short(textures::tiles(), &[Warped.into()]);
    }

    #[test]
    fn plastered() {
        short(textures::plastered(), &[Warped.into()]);
    }

    #[test]
    fn engraved() {
        short(textures::engraved(), &[]);
    }

    #[test]
    #[ignore = "minutes"]
    fn all() {
        long(textures::engraved());
        long(textures::tiles());
        long(textures::plastered());
    }
}

/// Smooth surfaces, masks and maps whose numbers change.
mod past {
    use super::{long, short, still};

    #[test]
    fn mirrors() {
        short(still::mirrors(), &[]);
    }

    #[test]
    fn veiled() {
        short(still::veiled(), &[]);
    }

    #[test]
    #[ignore = "minutes"]
    fn all() {
        long(still::mirrors());
        long(still::veiled());
    }
}
