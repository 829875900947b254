//! Image and derivatives by any estimator.

use drt_estimators::{Derivative, EstimatorKind, Rendering};

use super::monitor::Monitor;
use super::options::Options;
use super::run::{self, Shared};
use crate::{CliError, Job};

/// Image and derivatives by the job's estimator, filling the first `part` of the progress bar.
pub(super) fn derivatives(
    job: &Job,
    options: &Options,
    monitor: &Monitor,
    part: f64,
    shared: &mut Shared,
) -> Result<Rendering, CliError> {
    match job.settings.estimator {
        EstimatorKind::FiniteDifference => by_differences(job, options, monitor, part, shared),
        _ => {
            let mut session = run::prepare(job, &job.parameters, shared)?;
            monitor.stage("grad", 0.0, part);
            Ok(run::sample(&mut session, options, job.spp(), monitor))
        }
    }
}

fn by_differences(
    job: &Job,
    options: &Options,
    monitor: &Monitor,
    part: f64,
    shared: &mut Shared,
) -> Result<Rendering, CliError> {
    let mut session = run::prepare_forward(job, shared)?;
    monitor.stage("image", 0.0, 0.3 * part);
    let mut rendering = run::sample(&mut session, options, job.spp(), monitor);
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
