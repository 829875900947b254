//! What the machine gives: a second thread, and memory that does not grow with the samples.

use drt_estimators::{Session, Settings, Unattended};

use crate::common::scenes::{self, Detail, Subject};
use crate::common::turns::{Task, take_turns};

const TURNS: usize = 5;

pub(crate) fn threads() {
    println!(
        "THREADS: the time of one over that of two, on a machine that does nothing else (>= 1.9)"
    );
    println!();
    if !cfg!(feature = "parallel") {
        println!("one thread only: build with --features parallel\n");
        return;
    }
    println!("{:9} {:>6} {:>17}", "scene", "image", "derivative image");
    let [_, room, fog, _, cloud] = scenes::all(Detail::Fine).map(|s| s.with_film([64, 64]));
    for subject in [room, fog, cloud] {
        let gain = |parameters: usize| {
            let task = |threads| {
                let spp = 8;
                let mut session = session(&subject, parameters, threads);
                let task: Task<'_> = Box::new(move || {
                    session.run(spp, &Unattended);
                });
                task
            };
            let [one, two] = take_turns(TURNS, [task(1), task(2)]);
            one.over(&two)
        };
        println!("{:9} {:6.2} {:17.2}", subject.name, gain(0), gain(1));
    }
    println!();
}

fn session(subject: &Subject, parameters: usize, threads: usize) -> Session {
    let settings = Settings { threads, ..Settings::default() };
    Session::new(&subject.scene, &subject.parameters[0].1[..parameters], &settings)
        .expect("a valid scene")
}

/// To be called first: the peak is that of the process.
pub(crate) fn memory() {
    println!("MEMORY: the process's peak in MiB, ten parameters");
    println!();
    if peak().is_none() {
        println!("unknown on this platform\n");
        return;
    }
    println!("{:9} {:>8} {:>10} {:>15}", "scene", "prepared", "8 samples", "32 samples more");
    for subject in scenes::all(Detail::Fine) {
        let mut session = session(&subject, 10, 1);
        let prepared = peak();
        session.run(8, &Unattended);
        let short = peak();
        session.run(32, &Unattended);
        let [prepared, short, long] = [prepared, short, peak()].map(|p| p.unwrap_or(f64::NAN));
        println!("{:9} {prepared:8.2} {short:10.2} {long:15.2}", subject.name);
    }
    println!();
}

/// `VmHWM` of Linux.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}
