//! Extreme scenes against well-conditioned ones that must look and change alike.
//!
//! With more samples:
//! `cargo test --release -p drt-tests --test all -- --ignored stability:: --nocapture`

use drt_tests::cores::on_all_cores;
use drt_tests::stability::{Condition, Extent, Row, Table, conditions, examine};

fn run(conditions: &[Condition]) -> Vec<Row> {
    let rows = on_all_cores(conditions, |condition| {
        examine(condition).unwrap_or_else(|e| panic!("{}: {e}", condition.name))
    })
    .concat();
    print!("{}", Table(&rows));
    rows
}

/// `sharp` is the part of the comparisons that must see a planted fault.
fn judge(rows: &[Row], sharp: f64) {
    let failing = rows.iter().filter(|r| !r.passes()).count();
    let seen = rows.iter().filter(|r| r.sees_fault).count();
    println!("{} comparisons, of which {seen} see a planted fault", rows.len());
    assert_eq!(failing, 0, "comparisons that fail");
    assert!(seen as f64 > sharp * rows.len() as f64, "too little is seen");
}

#[test]
fn extreme_scenes_equal_ordinary_ones() {
    judge(&run(&conditions(Extent::Short).unwrap()), 0.6);
}

#[test]
#[ignore = "minutes"]
fn extreme_scenes_equal_ordinary_ones_precisely() {
    judge(&run(&conditions(Extent::Full).unwrap()), 0.8);
}
