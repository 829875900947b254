//! Figures that a user of the estimators may count on, as ratios measured in one run.
//!
//! `cargo bench -p drt-estimators --features parallel --bench figures -- [NAME...]`
//!
//! NAME is one or more of memory, cost, length, threads; without one, all of them. One thread
//! runs unless the table says otherwise. Contenders take turns, and a row gives the medians over the
//! turns; targets stand below the column they are for.

#[path = "../common/mod.rs"]
mod common;
mod cost;
mod length;
mod machine;

fn main() {
    // Cargo adds --bench.
    let names: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    let figures: [(&str, fn()); 4] = [
        ("memory", machine::memory),
        ("cost", cost::print),
        ("length", length::print),
        ("threads", machine::threads),
    ];
    for (name, print) in figures {
        if names.is_empty() || names.iter().any(|n| n == name) {
            print();
        }
    }
}
