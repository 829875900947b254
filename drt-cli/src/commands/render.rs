//! `drt render`: the image alone.

use super::monitor::Monitor;
use super::options::Options;
use super::outputs::Outputs;
use super::{Outcome, run};
use crate::CliError;

pub(super) fn run(options: &Options) -> Result<Outcome, CliError> {
    let job = run::open(options)?;
    let outputs = Outputs::new(options, "render")?;
    let mut session = run::prepare_forward(&job)?;
    let monitor = Monitor::new(options.changes.quiet);
    monitor.stage("render", 0.0, 1.0);
    let mut rendering = run::sample(&mut session, options, job.spp(), &monitor);
    monitor.finish();
    rendering.derivatives.clear();
    outputs.write(&job, &rendering, &[], &[])?;
    Ok(if rendering.complete { Outcome::Done } else { Outcome::Interrupted })
}
