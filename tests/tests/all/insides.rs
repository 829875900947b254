//! The inside does not matter: a medium may follow its surfaces in every way that is right, with one
//! derivative image.
//!
//! Each measures to the first noise given here, and with `--ignored` to the second:
//! `cargo test --release -p drt-tests --test all -- --ignored insides:: --nocapture`
//! With `DRT_WAY=WORD` only the first way and those with the word in their names, to measure one of them:
//! with `--features tetgen` the given tetrahedra are TetGen's.

use drt_tests::Result;
use drt_tests::insides::{Case, Table, cases, examine, sheets};

fn check(case: Result<Case>, noise: f64) {
    let mut case = case.unwrap();
    if let Ok(word) = std::env::var("DRT_WAY") {
        let first = case.right[0].name;
        case.right.retain(|way| way.name == first || way.name.contains(&word));
    }
    let finding = examine(&case, noise, 1 << 22).unwrap();
    println!("{}", Table(&finding));
    assert!(finding.holds());
}

macro_rules! insides {
    ($($set:ident::$case:ident: $noise:literal, $precise:literal;)*) => {
        mod short {
            $(#[test] fn $case() { super::check(super::$set::$case(), $noise); })*
        }
        mod precise {
            $(#[test] #[ignore = "minutes"] fn $case() {
                super::check(super::$set::$case(), $precise);
            })*
        }
    };
}

insides! {
    cases::black_body_in_fog: 0.06, 0.01;
    cases::body_around_the_eye: 0.1, 0.01;
    cases::bent_slab: 0.08, 0.01;
    cases::stretched_slab: 0.08, 0.01;
    cases::glass_ball_moves: 0.1, 0.01;
    cases::glass_ball_deforms: 0.1, 0.01;
    cases::turning_grid: 0.1, 0.01;
    cases::blob: 0.08, 0.01;
    cases::nested: 0.1, 0.01;
    sheets::room_of_sheets: 0.3, 0.04;
    sheets::lamp_in_room: 0.3, 0.04;
    sheets::room_with_gaps: 0.3, 0.04;
    sheets::room_without_a_wall: 0.3, 0.04;
    sheets::wall_bulges: 0.3, 0.04;
    sheets::room_moves_as_one: 0.3, 0.04;
}
