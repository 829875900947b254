//! What moves past mirrors, glass, panes and masks, and these, against finite differences of now:
//! `cargo test --release -p drt-tests --test all -- --ignored smooth:: --nocapture`

use drt_tests::Result;
use drt_tests::matrix::estimators::Effort;
use drt_tests::matrix::{Stage, reference, smooth};
use drt_tests::reference::Reference;

use crate::check_matrix::judge;

fn check(stage: Result<Stage>) {
    let mut stage = stage.unwrap();
    // Scales of derivatives are known to 1 to 5 % by so many.
    stage.cells.iter_mut().for_each(|cell| cell.samples *= 4);
    let effort = Effort { noise: 0.02, scale: 0.03, samples: stage.samples, seed: 0 };
    let references: Result<Vec<Reference>> =
        stage.cells.iter().map(|cell| reference::short(&stage, cell)).collect();
    judge(&stage, &references.unwrap(), &[], effort);
}

macro_rules! stages {
    ($($stage:ident)*) => {
        $(#[test]
        #[ignore = "minutes"]
        fn $stage() {
            check(smooth::$stage());
        })*
    };
}

stages! { mirror varnish panes slab silver_ball glass_ball lattice }
