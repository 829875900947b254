//! How noisy each number of each oracle is after a number of samples, and which term makes it so.
//!
//! `cargo run --release -p drt-tests --example noise -- [SAMPLES] [PART OF A NAME]`

use std::time::Instant;

use drt_estimators::{Session, Settings, Unattended};
use drt_tests::oracle::OracleFile;
use drt_tests::trial::Trial;

fn main() -> drt_tests::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let samples: u32 = arguments.next().map_or(Ok(1 << 17), |s| s.parse())?;
    let name = arguments.next().unwrap_or_default();
    for case in OracleFile::read()?.cases {
        for trial in Trial::of_case(&case)?.iter().filter(|t| t.name.contains(&name)) {
            let parameters: Vec<_> = trial.parameters.iter().map(|(p, _)| p.clone()).collect();
            let mut settings = Settings {
                threads: 1,
                seed: std::env::var("SEED").map_or(7, |s| s.parse().unwrap_or(7)),
                terms: true,
                ..Settings::default()
            };
            if std::env::var_os("STATIC").is_some() {
                settings.insides = (0..trial.built.scene.media.len())
                    .map(|m| (m, drt_estimators::InsideKind::Static))
                    .collect();
            }
            let start = Instant::now();
            let mut session = Session::new(&trial.built.scene, &parameters, &settings)?;
            session.run(samples, &Unattended);
            let seconds = start.elapsed().as_secs_f64();
            if std::env::var_os("PLAN").is_some() {
                println!("{}", session.plan());
            }
            let r = session.rendering();
            let largest = trial.parameters.iter().fold(0.0_f64, |m, (_, d)| m.max(d.abs()));
            let largest = if largest > 0.0 { largest } else { trial.value.abs() };
            let noise = trial.unit * r.image.total.stderr.g / trial.value.abs();
            println!("\n{}  {seconds:.2} s, value {:.3}% at {samples}", trial.name, 100.0 * noise);
            for (d, (_, expected)) in r.derivatives.iter().zip(&trial.parameters) {
                let scale = if expected.abs() < 0.01 * largest { largest } else { expected.abs() };
                let percent = |e: f64| 100.0 * trial.unit * e / scale;
                let noise = percent(d.total.total.stderr.g);
                let off = (d.total.total.mean.g * trial.unit - expected)
                    / (d.total.total.stderr.g * trial.unit);
                let minutes = seconds / 60.0 * (noise / 0.3).powi(2);
                print!("  {:<44} {noise:>7.2}% z {off:>5.1} {minutes:>7.1} min:", d.name);
                for (term, layer) in &d.terms {
                    if layer.total.stderr.g > 0.0 {
                        print!(" {term:?} {:.2}", percent(layer.total.stderr.g));
                    }
                }
                println!();
            }
        }
    }
    Ok(())
}
