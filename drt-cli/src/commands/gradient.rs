//! `drt grad --loss` and `--adjoint`: the gradient of a loss by the parameters.

use std::path::Path;

use drt_estimators::fit::{Fit, View};
use drt_estimators::loss::{Loss, Reference};
use drt_estimators::{Target, gradient, moved};
use drt_math::Rgb;

use super::derivatives::derivatives;
use super::monitor::Monitor;
use super::options::GradOptions;
use super::{Outcome, run};
use crate::error::Place;
use crate::image::read_picture;
use crate::npy::write_npy;
use crate::{CliError, Job, check_target};

/// Between the seeds of an image and of the gradient by what it says.
const INDEPENDENT: u64 = 0xa076_1d64_78bd_642f;

/// Writes the gradient where `--output` says: one number per parameter in the job's order, then those
/// of each group.
pub(super) fn run(options: &GradOptions) -> Result<Outcome, CliError> {
    let common = &options.common;
    for (name, given) in [
        ("terms", options.terms),
        ("digest", common.digest.is_some()),
        ("preview", common.preview.is_some()),
        ("loss", options.loss.is_some() && options.adjoint.is_some()),
        ("seconds", common.seconds.is_some()),
        ("target-error", common.target_error.is_some()),
    ] {
        if given {
            return Err(CliError::argument(format!("--{name} does not go with a gradient")));
        }
    }
    let Some(output) = &common.output else {
        return Err(CliError::argument("a gradient needs -o FILE.npy to be written to"));
    };
    check_target(output)?;
    let mut job = run::open(common)?;
    if job.text.is_none() {
        return Err(CliError::argument(format!(
            "{} is a scene; a gradient needs a job, a .toml file with parameters",
            common.input.display()
        )));
    }
    let monitor = Monitor::new(common.changes.quiet);
    let gradient = match (&options.loss, &options.adjoint) {
        (Some(target), _) => of_loss(&mut job, options, target, &monitor)?,
        (None, Some(adjoint)) => {
            let adjoint = picture(&job, adjoint)?;
            of_adjoint(&mut job, options, &adjoint, &monitor)?
        }
        (None, None) => None,
    };
    monitor.finish();
    let Some(gradient) = gradient else { return Ok(Outcome::Interrupted) };
    write_npy(output, &gradient)?;
    Ok(Outcome::Done)
}

/// By the job's own loss, where it names one.
fn of_loss(
    job: &mut Job,
    options: &GradOptions,
    target: &Path,
    monitor: &Monitor,
) -> Result<Option<Vec<f64>>, CliError> {
    let fail = |e| CliError::input(&Place::file(target), e);
    let pixels = picture(job, target)?;
    let sensor = job.settings.sensor;
    let size = job.scene.sensors[sensor].item.sensor.film();
    let reference = Reference::new(size, pixels).map_err(fail)?;
    let loss = job.optimize()?.map_or(Loss::L2, |o| o.loss);
    if !job.groups.is_empty() {
        // Image and gradient need independent samples.
        let mut session = run::prepare_forward(job, &mut run::Shared::default())?;
        monitor.stage("image", 0.0, 0.3);
        let rendering = run::sample(&mut session, &options.common, job.spp(), monitor);
        if !rendering.complete {
            return Ok(None);
        }
        let image: Vec<Rgb> = rendering.image.pixels.iter().map(|p| p.mean).collect();
        job.settings.seed = job.settings.seed.wrapping_add(INDEPENDENT);
        return of_adjoint(job, options, &loss.adjoint(&image, &reference), monitor);
    }
    let (scene, views) = (job.scene.clone(), vec![View { sensor, reference }]);
    let mut fit = Fit::new(scene, job.parameters.clone(), views, loss, job.settings.clone())
        .map_err(|e| job.blame(&e))?;
    let values: Vec<f64> = job.parameters.iter().map(|p| p.value).collect();
    monitor.stage("gradient", 0.0, 1.0);
    let seen = fit.evaluate(&values, job.spp(), job.settings.seed, monitor);
    Ok(seen.map_err(|e| job.blame(&e))?.map(|seen| seen.gradient()))
}

/// Forward for the parameters, in reverse for the groups.
fn of_adjoint(
    job: &mut Job,
    options: &GradOptions,
    adjoint: &[Rgb],
    monitor: &Monitor,
) -> Result<Option<Vec<f64>>, CliError> {
    let mut numbers = Vec::new();
    if !job.parameters.is_empty() {
        let rendering =
            derivatives(job, &options.common, monitor, 0.6, &mut run::Shared::default())?;
        if !rendering.complete {
            return Ok(None);
        }
        numbers.extend(rendering.derivatives.iter().map(|d| -> f64 {
            d.total.pixels.iter().zip(adjoint).map(|(p, a)| p.mean.dot(*a)).sum()
        }));
    }
    if !job.groups.is_empty() {
        monitor.stage("gradient in reverse", 0.6, 1.0);
        let scene = moved(&job.scene, &job.parameters).map_err(|e| job.blame(&e))?;
        let wanted: Vec<Target> = job.groups.iter().map(|g| g.target).collect();
        let gradient = gradient(&scene, &wanted, &job.settings, job.spp(), adjoint, monitor);
        let gradient = gradient.map_err(|e| job.blame(&e))?;
        for group in &job.groups {
            group.collect(&job.scene, &scene, &gradient, &mut numbers);
        }
    }
    Ok((!monitor.interrupted()).then_some(numbers))
}

/// An image of the film's size.
fn picture(job: &Job, path: &Path) -> Result<Vec<Rgb>, CliError> {
    let Some(sensor) = job.scene.sensors.get(job.settings.sensor) else {
        return Err(CliError::input(&Place::file(&job.scene_path), "the scene has no <sensor>"));
    };
    let picture = read_picture(path)?;
    picture.check_size(path, sensor.item.sensor.film())?;
    Ok(picture.linear())
}
