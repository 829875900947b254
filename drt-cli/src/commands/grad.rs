//! `drt grad`: the image and its derivatives.

use super::derivatives::derivatives;
use super::monitor::Monitor;
use super::options::{GradOptions, Options};
use super::outputs::{Outputs, name_written, output_or_beside};
use super::{Outcome, loss_gradient, noted, run, shard};
use crate::CliError;

pub(super) fn run(options: &GradOptions) -> Result<Outcome, CliError> {
    if options.loss.is_some() || options.adjoint.is_some() {
        return loss_gradient::run(options);
    }
    let given = &options.common;
    let mut job = run::open_with_parameters(given)?;
    job.settings.terms = options.terms;
    if options.terms {
        job.check_terms()?;
    }
    if let Some(shard) = options.shard {
        return shard::images(&job, given, "grad", shard);
    }
    let output = output_or_beside(given, "exr");
    let common = &Options { output: Some(output.clone()), ..given.clone() };
    let outputs = Outputs::of_images(common, &job, "grad")?;
    let monitor = Monitor::new(common.changes.quiet);
    let rendering = derivatives(&job, common, &monitor, 1.0, &mut run::Shared::default())?;
    monitor.finish();
    outputs.write(&job, &rendering, &[], &[])?;
    name_written(given, &output);
    Ok(noted(&rendering))
}
