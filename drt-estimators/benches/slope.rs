//! How the error falls with the number of samples N, and what Sobol' numbers are worth.
//!
//! `cargo bench -p drt-estimators --bench slope -- [SCENE...]`
//!
//! Errors are the scatter of each pixel between runs that differ by their seeds alone. A film of
//! six pixels gives each 32 Sobol' sequences (larger ones 4), so at 16 samples per pixel (and as
//! few boundary samples on this film) every sample is the first of its sequence: independent random
//! numbers. Their variance at N is therefore 16 / N times that at 16. The few pixels are large and
//! full of edges; smaller ones gain more. With two runs at the largest N, the last column is known to
//! half its value.

use drt_estimators::{Layer, Session, Settings, Unattended};
use drt_math::Moments;

mod common;
use common::scenes::{self, Detail, Subject};

const FILM: [u32; 2] = [3, 2];
/// Three decades.
const SAMPLES: [u32; 6] = [16, 64, 256, 1024, 4096, 16384];

fn main() {
    // Cargo adds --bench.
    let names: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    println!("SLOPE of the error against the number of samples N, and the variance of random over");
    println!("that of Sobol' numbers at the same N");
    println!();
    print!("{:9} {:20} {:>7}", "scene", "layer", "slope");
    SAMPLES[1..].iter().for_each(|n| print!(" {n:>7}"));
    println!("\n{:9} {:20} {:>7}", "", "", "<= -0.5");
    for subject in scenes::all(Detail::Coarse).map(|subject| subject.with_film(FILM)) {
        if !(names.is_empty() || names.iter().any(|n| n == subject.name)) {
            continue;
        }
        let first = subject.parameters.iter().map(|(_, ten)| ten[0].clone());
        let names = ["image"].into_iter().chain(subject.parameters.iter().map(|(kind, _)| *kind));
        let parameters: Vec<_> = first.collect();
        let errors = SAMPLES.map(|n| scatter(&subject, &parameters, n));
        for (layer, name) in names.enumerate() {
            let errors = errors.each_ref().map(|e| e[layer]);
            print!("{:9} {name:20} {:7.2}", subject.name, slope(&errors));
            for (n, e) in SAMPLES.iter().zip(&errors).skip(1) {
                let random = errors[0].powi(2) * f64::from(SAMPLES[0]) / f64::from(*n);
                print!(" {:7.1}", random / e.powi(2));
            }
            println!();
        }
    }
}

/// Per layer, the root mean square over pixels and channels of the standard deviation between runs.
fn scatter(subject: &Subject, parameters: &[drt_motion::Parameter], spp: u32) -> Vec<f64> {
    // As many samples in all at each N where time permits, so that rare large values show alike.
    let runs = u32::min(2 * SAMPLES[SAMPLES.len() - 1] / spp, 256);
    let mut moments = vec![Vec::new(); 1 + parameters.len()];
    for seed in 0..u64::from(runs) {
        let settings = Settings { seed, threads: 1, ..Settings::default() };
        let mut session =
            Session::new(&subject.scene, parameters, &settings).expect("a valid scene");
        session.run(spp, &Unattended);
        let r = session.rendering();
        let layers = [&r.image].into_iter().chain(r.derivatives.iter().map(|d| &d.total));
        for (moments, layer) in moments.iter_mut().zip(layers) {
            let values = values(layer);
            moments.resize(values.len(), Moments::ZERO);
            for (m, v) in moments.iter_mut().zip(values) {
                m.push(v);
            }
        }
    }
    let mean = |m: &Vec<Moments>| m.iter().map(Moments::variance).sum::<f64>() / m.len() as f64;
    moments.iter().map(|m| mean(m).sqrt()).collect()
}

fn values(layer: &Layer) -> Vec<f64> {
    layer.pixels.iter().flat_map(|p| p.mean.to_array()).collect()
}

/// The least-squares slope of log error against log samples.
fn slope(errors: &[f64; SAMPLES.len()]) -> f64 {
    let n = SAMPLES.len() as f64;
    let points = SAMPLES.iter().zip(errors).map(|(s, e)| [f64::from(*s).ln(), e.ln()]);
    let [x, y] = points.clone().fold([0.0; 2], |[a, b], [x, y]| [a + x / n, b + y / n]);
    let sum = |f: fn(f64, f64) -> f64| points.clone().map(|[p, q]| f(p - x, q - y)).sum::<f64>();
    sum(|dx, dy| dx * dy) / sum(|dx, _| dx * dx)
}
