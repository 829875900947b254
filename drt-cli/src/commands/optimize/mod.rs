//! `drt optimize`: the parameters at which a scene looks like its targets.

mod checkpoint;
mod descent;
mod history;
mod problem;

use super::monitor::Monitor;
use super::options::OptimizeOptions;
use super::{Outcome, run};
use crate::CliError;
use descent::Descent;
use problem::Problem;

pub(super) fn run(options: &OptimizeOptions) -> Result<Outcome, CliError> {
    let job = run::open_changed(&options.input, &options.changes)?;
    job.require_derivatives()?;
    let problem = Problem::new(&job, options)?;
    let monitor = Monitor::new(options.changes.quiet);
    let mut descent = Descent::begin(&problem, options)?;
    let outcome = descent.run(&monitor);
    monitor.finish();
    let outcome = outcome?;
    if !options.changes.quiet {
        print!("{}", descent.summary());
    }
    Ok(outcome)
}
