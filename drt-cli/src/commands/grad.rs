//! `drt grad`: the image and its derivatives.

use super::derivatives::derivatives;
use super::monitor::Monitor;
use super::options::GradOptions;
use super::outputs::Outputs;
use super::{Outcome, loss_gradient, noted, run, shard};
use crate::CliError;

pub(super) fn run(options: &GradOptions) -> Result<Outcome, CliError> {
    if options.loss.is_some() || options.adjoint.is_some() {
        return loss_gradient::run(options);
    }
    let common = &options.common;
    let mut job = run::open_with_parameters(common)?;
    job.settings.terms = options.terms;
    if options.terms {
        job.check_terms()?;
    }
    if let Some(shard) = options.shard {
        return shard::images(&job, common, "grad", shard);
    }
    let outputs = Outputs::new(common, &job, "grad")?;
    let monitor = Monitor::new(common.changes.quiet);
    let rendering = derivatives(&job, common, &monitor, 1.0, &mut run::Shared::default())?;
    monitor.finish();
    outputs.write(&job, &rendering, &[], &[])?;
    Ok(noted(&rendering))
}
