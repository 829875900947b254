//! `drt bench`: error against run time at doubling sample counts, for the image, the derivatives by the job's
//! estimator, and finite differences.

mod measure;
mod plot;
mod reference;
mod report;
mod series;

use std::io::Write;
use std::path::{Path, PathBuf};

use super::destinations::Destinations;
use super::monitor::Monitor;
use super::options::BenchOptions;
use super::{Outcome, run, stop};
use crate::commands::console;
use crate::{CliError, Job, write_atomically};
use measure::Budget;
use reference::Reference;
use series::Series;

pub(super) fn run(options: &BenchOptions) -> Result<Outcome, CliError> {
    let destinations =
        Destinations::new([("--csv", options.csv.as_deref()), ("--plot", options.plot.as_deref())]);
    destinations.spare(options.inputs.iter().chain(&options.reference).map(PathBuf::as_path))?;
    destinations.check()?;
    if options.reference.is_some() && options.inputs.len() > 1 {
        return Err(CliError::argument("--reference belongs to one job; several are given"));
    }
    // All inputs are read before time is spent on the first.
    let jobs = options
        .inputs
        .iter()
        .map(|input| run::open_changed(input, &options.changes))
        .collect::<Result<Vec<_>, _>>()?;
    destinations.spare(jobs.iter().flat_map(Job::inputs))?;
    let reference = options.reference.as_deref().map(Reference::read).transpose()?;
    let budget = Budget { seconds: options.seconds, spp: options.spp };
    let monitor = Monitor::new(options.changes.quiet);
    let mut all: Vec<Series> = Vec::new();
    let mut kept = None;
    for job in &jobs {
        kept = keep(options, &all);
        all.extend(measure::job(job, reference.as_ref(), budget, &monitor)?);
        if monitor.interrupted() {
            break;
        }
    }
    monitor.finish();
    let _writing = stop::writing();
    // What is told from here on is more.
    drop(kept);
    tell(&all, options.csv.as_deref(), options.plot.as_deref())?;
    Ok(if monitor.interrupted() { Outcome::Interrupted } else { Outcome::Done })
}

/// Shows all measurements where they were asked for.
fn tell(all: &[Series], csv: Option<&Path>, plot: Option<&Path>) -> Result<(), CliError> {
    console::print(report::table(all).to_string())?;
    if let Some(path) = csv {
        write_atomically(path, |out| Ok(out.write_all(report::csv(all).as_bytes())?))?;
    }
    if let Some(path) = plot {
        write_atomically(path, |out| Ok(out.write_all(plot::svg(all).as_bytes())?))?;
    }
    Ok(())
}

/// What is shown where the program must end while the next job is prepared.
fn keep(options: &BenchOptions, all: &[Series]) -> Option<stop::Kept> {
    let (all, csv, plot) = (all.to_vec(), options.csv.clone(), options.plot.clone());
    let any = !all.is_empty();
    // Nobody is left to be told that it cannot be written.
    any.then(|| stop::rescue(move || drop(tell(&all, csv.as_deref(), plot.as_deref()))))
}
