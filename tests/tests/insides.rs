//! The inside does not matter: a medium may follow its surfaces in every way that is right, with one
//! derivative image.
//!
//! The short form measures to 3 % noise; to 1 %:
//! `cargo test --release -p drt-tests --test insides -- --ignored --nocapture`

use drt_tests::Result;
use drt_tests::insides::{Case, Table, cases, examine};

fn check(case: Result<Case>, noise: f64, samples: u32) {
    let finding = examine(&case.unwrap(), noise, samples).unwrap();
    println!("{}", Table(&finding));
    assert!(finding.holds());
}

macro_rules! insides {
    ($($case:ident)*) => {
        mod short {
            $(#[test] fn $case() { super::check(super::cases::$case(), std::env::var("NOISE").map_or(0.03, |v| v.parse().unwrap()), std::env::var("SPP").map_or(1 << 16, |v| v.parse().unwrap())); })*
        }
        mod precise {
            $(#[test] #[ignore = "minutes"] fn $case() {
                super::check(super::cases::$case(), 0.01, 1 << 20);
            })*
        }
    };
}

insides! {
    black_body_in_fog body_around_the_eye bent_slab stretched_slab glass_ball_moves
    glass_ball_deforms turning_grid blob nested
}
