//! What a random number costs, and what Sobol' points are worth.
//!
//! `cargo bench -p drt-math --bench points`
//!
//! The worth of N points is the variance of a mean over N random points, divided by that over the
//! first N points of a scrambled sequence. One point of a sequence is a random point, so N = 1 tells
//! the variance of random ones. Integrands are a product of smooth bumps, and the inside of a ball: an
//! edge, as pixels and shadows have them.

use std::hint::black_box;
use std::time::Instant;

use drt_math::sobol::{self, SobolSampler};
use drt_math::{Moments, Rng};

fn main() {
    numbers();
    worth();
}

/// Numbers of a sample.
const PER_SAMPLE: u32 = 32;

fn numbers() {
    const SAMPLES: u32 = 500;
    const TURNS: usize = 200;
    let rng = |i| Rng::new(1, 2, i);
    let point = |i| SobolSampler::new(7, i);
    // Every sample starts anew, as those of a renderer do.
    let samplers: [(&str, &dyn Fn(u32)); 3] = [
        ("random", &|i| draw(rng(i), Rng::next_f64)),
        ("Sobol'", &|i| draw(point(i), SobolSampler::next_f64)),
        ("random, led by Sobol'", &|i| draw(rng(i).led_by(point(i), PER_SAMPLE), Rng::next_f64)),
    ];
    let mut seconds = [const { Vec::new() }; 3];
    for _ in 0..TURNS {
        for ((_, sample), seconds) in samplers.iter().zip(&mut seconds) {
            let start = Instant::now();
            (0..SAMPLES).for_each(sample);
            seconds.push(start.elapsed().as_secs_f64());
        }
    }
    println!("{:24} {:>8}", "numbers", "ns");
    for ((name, _), mut seconds) in samplers.iter().zip(seconds) {
        seconds.sort_unstable_by(f64::total_cmp);
        let median = seconds[TURNS / 2];
        println!("{name:24} {:8.2}", median / f64::from(SAMPLES * PER_SAMPLE) * 1e9);
    }
    println!();
}

fn draw<T>(mut source: T, next: fn(&mut T) -> f64) {
    for _ in 0..PER_SAMPLE {
        black_box(next(&mut source));
    }
}

type Integrand = fn(&[f64]) -> f64;

fn worth() {
    const COUNTS: [u32; 7] = [2, 4, 16, 64, 256, 1024, 4096];
    const SEQUENCES: u32 = 400;
    print!("{:24}", "worth of N points");
    COUNTS.iter().for_each(|n| print!(" {n:>8}"));
    println!();
    let integrands: [(&str, Integrand); 2] = [("smooth", smooth), ("edge", edge)];
    for (name, f) in integrands {
        for dimensions in [2, 4, 8] {
            let variance = |n: u32| {
                let mean = |seed| {
                    let sum: f64 = (0..n).map(|i| f(&point(i, seed)[..dimensions])).sum();
                    sum / f64::from(n)
                };
                (0..SEQUENCES).map(mean).collect::<Moments>().variance()
            };
            let random = variance(1);
            print!("{:24}", format!("{name}, {dimensions} dimensions"));
            COUNTS.iter().for_each(|&n| print!(" {:8.1}", random / f64::from(n) / variance(n)));
            println!();
        }
    }
}

fn point(index: u32, seed: u32) -> [f64; 8] {
    core::array::from_fn(|d| sobol::sample(index, d as u32, seed))
}

fn smooth(x: &[f64]) -> f64 {
    x.iter().map(|x| 1.0 + (x - 0.5) * (3.0 * x).sin()).product()
}

/// Whether a point lies in a ball around a corner that takes about half of the cube.
fn edge(x: &[f64]) -> f64 {
    let squares: f64 = x.iter().map(|x| x * x).sum();
    if squares < x.len() as f64 / 3.0 { 1.0 } else { 0.0 }
}
