//! What moves past mirrors, glass, panes and masks, and these, against finite differences of now:
//! `cargo test --release -p drt-tests --test all -- --ignored smooth:: --nocapture`

use drt_tests::Result;
use drt_tests::matrix::estimators::Effort;
use drt_tests::matrix::{Stage, reference, smooth};
use drt_tests::reference::Reference;

use crate::check_matrix::judge;

fn check(stage: Result<Stage>, more: u32) {
    let mut stage = stage.unwrap();
    stage.cells.iter_mut().for_each(|cell| cell.samples *= more);
    let effort = Effort { noise: 0.02, scale: 0.03, samples: stage.samples, seed: 0 };
    let references: Result<Vec<Reference>> =
        stage.cells.iter().map(|cell| reference::short(&stage, cell)).collect();
    judge(&stage, &references.unwrap(), &[], effort);
}

macro_rules! stages {
    ($($stage:ident: $more:literal,)*) => {
        $(#[test]
        #[ignore = "minutes"]
        fn $stage() {
            check(smooth::$stage(), $more);
        })*
    };
}

// Times as many samples as the stage asks for. Scales of derivatives are known to 1 to 5 % by so many, and behind curved glass to 5 to 20 %.
stages! {
    mirror: 4,
    varnish: 4,
    panes: 4,
    slab: 4,
    silver_ball: 4,
    glass_ball: 1,
    milky_glass: 1,
    water: 1,
}
