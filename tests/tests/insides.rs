//! The inside does not matter: a medium may follow its surfaces in every way that is right, with one
//! derivative image.
//!
//! The short form measures to the noise given here; to 1 %:
//! `cargo test --release -p drt-tests --test insides -- --ignored --nocapture`

use drt_tests::Result;
use drt_tests::insides::{Case, Table, cases, examine};

fn check(case: Result<Case>, noise: f64) {
    let finding = examine(&case.unwrap(), noise, 1 << 20).unwrap();
    println!("{}", Table(&finding));
    assert!(finding.holds());
}

macro_rules! insides {
    ($($case:ident: $noise:literal;)*) => {
        mod short {
            $(#[test] fn $case() { super::check(super::cases::$case(), $noise); })*
        }
        mod precise {
            $(#[test] #[ignore = "minutes"] fn $case() {
                super::check(super::cases::$case(), 0.01);
            })*
        }
    };
}

insides! {
    black_body_in_fog: 0.08;
    body_around_the_eye: 0.1;
    bent_slab: 0.03;
    stretched_slab: 0.03;
    glass_ball_moves: 0.08;
    glass_ball_deforms: 0.08;
    turning_grid: 0.06;
    blob: 0.03;
    nested: 0.06;
}
