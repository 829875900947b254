//! `drt grad`: the image and its derivatives.

use drt_estimators::{Derivative, EstimatorKind, Rendering};

use super::monitor::Monitor;
use super::options::{GradOptions, Options};
use super::outputs::Outputs;
use super::{Outcome, gradient, run};
use crate::{CliError, Job};

pub(super) fn run(options: &GradOptions) -> Result<Outcome, CliError> {
    if options.loss.is_some() || options.adjoint.is_some() {
        return gradient::run(options);
    }
    let common = &options.common;
    let mut job = run::open_with_parameters(common)?;
    job.settings.terms = options.terms;
    let outputs = Outputs::new(common, "grad")?;
    let monitor = Monitor::new(common.changes.quiet);
    let rendering = derivatives(&job, common, &monitor, 1.0)?;
    monitor.finish();
    outputs.write(&job, &rendering, &[], &[])?;
    Ok(if rendering.complete { Outcome::Done } else { Outcome::Interrupted })
}

/// Image and derivatives by the job's estimator, filling the first `part` of the progress bar.
pub(super) fn derivatives(
    job: &Job,
    options: &Options,
    monitor: &Monitor,
    part: f64,
) -> Result<Rendering, CliError> {
    match job.settings.estimator {
        EstimatorKind::FiniteDifference => by_differences(job, options, monitor, part),
        _ => {
            let mut session = run::prepare(job, &job.parameters)?;
            monitor.stage("grad", 0.0, part);
            Ok(run::sample(&mut session, options, job.settings.spp, monitor))
        }
    }
}

fn by_differences(
    job: &Job,
    options: &Options,
    monitor: &Monitor,
    part: f64,
) -> Result<Rendering, CliError> {
    let mut session = run::prepare_forward(job)?;
    monitor.stage("image", 0.0, 0.3 * part);
    let mut rendering = run::sample(&mut session, options, job.settings.spp, monitor);
    rendering.derivatives.clear();
    if !rendering.complete {
        return Ok(rendering);
    }
    monitor.stage("finite differences", 0.3 * part, part);
    match run::differences(job, rendering.spp, job.settings.step, monitor)? {
        Some(layers) => {
            let named = job.parameters.iter().zip(layers);
            rendering.derivatives = named
                .map(|(p, total)| Derivative { name: p.name.clone(), total, terms: Vec::new() })
                .collect();
        }
        None => rendering.complete = false,
    }
    Ok(rendering)
}
