//! Image and derivatives by any estimator.

use std::time::Instant;

use drt_estimators::{EstimatorKind, Rendering};

use super::console;
use super::monitor::Monitor;
use super::noise::largest_noise;
use super::options::Options;
use super::run::{self, Shared};
use crate::prepared::gradient::named;
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
            if let Some(why) = session.plan().estimator.as_ref().filter(|_| !options.changes.quiet)
            {
                console::note(format_args!("drt: the estimator is {why}"));
            }
            monitor.stage("grad", 0.0, part);
            Ok(run::sample(&mut session, options, job.spp(), monitor, monitor))
        }
    }
}

/// Stop rules are met by the image first, then by the differences, from as many samples as it took or more.
fn by_differences(
    job: &Job,
    options: &Options,
    monitor: &Monitor,
    part: f64,
    shared: &mut Shared,
) -> Result<Rendering, CliError> {
    let started = Instant::now();
    run::tell_one_sided(job, options.changes.quiet)?;
    let mut session = run::prepare_forward(job, shared)?;
    monitor.stage("image", 0.0, 0.3 * part);
    let images = 1.0 + 2.0 * job.parameters.len() as f64;
    let seconds = options.seconds.map(|seconds| seconds / images);
    let of_image = Options { seconds, ..options.clone() };
    let mut rendering = run::sample(&mut session, &of_image, job.spp(), monitor, monitor);
    rendering.derivatives.clear();
    if !rendering.complete {
        return Ok(rendering);
    }
    monitor.stage("finite differences", 0.3 * part, part);
    let mut spp = rendering.spp;
    loop {
        let began = Instant::now();
        let Some(layers) = run::differences(job, spp, job.settings.step, monitor)? else {
            rendering.complete = false;
            return Ok(rendering);
        };
        rendering.derivatives = named(&job.parameters, layers);
        let more = more_samples(&rendering, options, spp, started, began);
        let Some(more) = more else { return Ok(rendering) };
        spp = more;
        monitor.stage(&format!("finite differences, {spp} spp"), 0.5 * part, part);
    }
}

/// Samples with which differences are worth being made anew, where noise decides and time allows: at least twice those there were.
fn more_samples(
    rendering: &Rendering,
    options: &Options,
    spp: u32,
    started: Instant,
    began: Instant,
) -> Option<u32> {
    let noise = largest_noise(rendering);
    // Noise falls with the square root of the number of samples.
    let needed = (noise / options.target_error?).powi(2);
    let mut factor = needed.clamp(2.0, 16.0);
    if let Some(seconds) = options.seconds {
        let left = seconds - started.elapsed().as_secs_f64();
        factor = factor.min(left / began.elapsed().as_secs_f64());
    }
    let limit = options.spp.unwrap_or(u32::MAX);
    let more = u32::min((f64::from(spp) * factor) as u32, limit);
    (needed > 1.0 && factor >= 2.0 && more > spp).then_some(more)
}
