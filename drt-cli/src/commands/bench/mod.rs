//! `drt bench`: error against run time at doubling sample counts, for every estimator that applies.

mod measure;
mod plot;
mod reference;
mod report;
mod series;

use std::io::Write;

use super::monitor::Monitor;
use super::options::BenchOptions;
use super::{Outcome, run};
use crate::{CliError, check_target, write_atomically};
use measure::Budget;
use reference::Reference;
use series::Series;

pub(super) fn run(options: &BenchOptions) -> Result<Outcome, CliError> {
    for path in [&options.csv, &options.plot].into_iter().flatten() {
        check_target(path)?;
    }
    if options.reference.is_some() && options.inputs.len() > 1 {
        return Err(CliError::argument("--reference belongs to one job; several are given"));
    }
    // All inputs are read before time is spent on the first.
    let jobs = options
        .inputs
        .iter()
        .map(|input| run::open_changed(input, &options.changes))
        .collect::<Result<Vec<_>, _>>()?;
    let reference = options.reference.as_deref().map(Reference::read).transpose()?;
    let budget = Budget { seconds: options.seconds, spp: options.spp };
    let monitor = Monitor::new(options.changes.quiet);
    let mut all: Vec<Series> = Vec::new();
    for job in &jobs {
        all.extend(measure::job(job, reference.as_ref(), budget, &monitor)?);
        if monitor.interrupted() {
            break;
        }
    }
    monitor.finish();
    print!("{}", report::table(&all));
    if let Some(path) = &options.csv {
        write_atomically(path, |out| Ok(out.write_all(report::csv(&all).as_bytes())?))?;
    }
    if let Some(path) = &options.plot {
        write_atomically(path, |out| Ok(out.write_all(plot::svg(&all).as_bytes())?))?;
    }
    Ok(if monitor.interrupted() { Outcome::Interrupted } else { Outcome::Done })
}
