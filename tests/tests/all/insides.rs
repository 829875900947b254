//! The inside does not matter: a medium may follow its surfaces in every way that is right, with one
//! derivative image.
//!
//! All ways are judged by a stored derivative of a long run, and the first way by stored finite differences where these apply. With
//! `--ignored` they are measured to the second noise given here, and judged by the first way:
//! `cargo test --release -p drt-tests --test all -- --ignored insides::precise --nocapture`
//! With `DRT_WAY=WORD` only the first way and those with the word in their names, to measure one of them:
//! with `--features tetgen` the given tetrahedra are TetGen's.

use drt_tests::Result;
use drt_tests::insides::{Case, Table, cases, examine, references, sheets, stored};
use drt_tests::reference::{Reference, write};

use crate::references::{disagreeing, next_seed, renews};

fn check(case: Result<Case>, noise: f64, known: impl Fn(&Case) -> Result<Vec<Reference>>) {
    let mut case = case.unwrap();
    if let Ok(word) = std::env::var("DRT_WAY") {
        let first = case.right[0].name;
        case.right.retain(|way| way.name == first || way.name.contains(&word));
    }
    let known = known(&case).unwrap_or_else(|e| panic!("{e}"));
    let finding = examine(&case, noise, 1 << 22, &known).unwrap();
    println!("{}", Table(&finding));
    assert!(finding.holds());
}

fn renew(case: Result<Case>, noise: f64) {
    let case = case.unwrap();
    let stored = stored(&case);
    let new = references(&case, noise, next_seed(&stored)).unwrap();
    let failing = disagreeing(case.name, &stored, &new);
    assert_eq!(failing, 0, "{failing} stored derivatives do not agree with new ones");
    if renews(&stored) {
        write(case.name, &new).unwrap();
    }
}

macro_rules! insides {
    ($($set:ident::$case:ident: $noise:literal, $precise:literal;)*) => {
        mod short {
            $(#[test] fn $case() { super::check(super::$set::$case(), $noise, super::stored); })*
        }
        mod precise {
            $(#[test] #[ignore = "minutes"] fn $case() {
                super::check(super::$set::$case(), $precise, |_| Ok(Vec::new()));
            })*
        }
        mod references_of {
            $(#[test] #[ignore = "minutes"] fn $case() {
                super::renew(super::$set::$case(), $noise);
            })*
        }
    };
}

// The stored derivatives have a fourth of the first noise: comparisons are as sharp as those of two images of 0.73 of it.
insides! {
    cases::black_body_in_fog: 0.08, 0.01;
    cases::body_around_the_eye: 0.13, 0.01;
    cases::bent_slab: 0.11, 0.01;
    cases::stretched_slab: 0.11, 0.01;
    cases::glass_ball_moves: 0.13, 0.01;
    cases::glass_ball_deforms: 0.13, 0.01;
    cases::turning_grid: 0.13, 0.01;
    cases::blob: 0.11, 0.01;
    cases::nested: 0.13, 0.01;
    sheets::room_of_sheets: 0.4, 0.04;
    sheets::lamp_in_room: 0.4, 0.04;
    sheets::room_with_gaps: 0.4, 0.04;
    sheets::room_without_a_wall: 0.4, 0.04;
    sheets::wall_bulges: 0.4, 0.04;
    sheets::room_moves_as_one: 0.4, 0.04;
}
