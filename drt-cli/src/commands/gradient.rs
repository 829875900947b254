//! `drt grad --loss` and `--adjoint`: the gradient of a loss by the parameters.

use std::path::Path;

use drt_estimators::Rendering;
use drt_estimators::fit::{Fit, View};
use drt_estimators::loss::{Loss, Reference};
use drt_math::Rgb;

use super::monitor::Monitor;
use super::options::GradOptions;
use super::{Outcome, grad, run};
use crate::error::Place;
use crate::image::read_picture;
use crate::npy::write_npy;
use crate::{CliError, Job, check_target};

/// Writes the gradient, one number per parameter in the job's order, where `--output` says.
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
    let job = run::open_with_parameters(common)?;
    let monitor = Monitor::new(common.changes.quiet);
    let gradient = match (&options.loss, &options.adjoint) {
        (Some(target), _) => of_loss(&job, target, &monitor)?,
        (None, Some(adjoint)) => {
            let adjoint = picture(&job, adjoint)?;
            let rendering = grad::derivatives(&job, common, &monitor, 1.0)?;
            rendering.complete.then(|| of_adjoint(&rendering, &adjoint))
        }
        (None, None) => None,
    };
    monitor.finish();
    let Some(gradient) = gradient else { return Ok(Outcome::Interrupted) };
    write_npy(output, &gradient)?;
    Ok(Outcome::Done)
}

/// By the job's own loss, where it names one.
fn of_loss(job: &Job, target: &Path, monitor: &Monitor) -> Result<Option<Vec<f64>>, CliError> {
    let fail = |e| CliError::input(&Place::file(target), e);
    let pixels = picture(job, target)?;
    let sensor = job.settings.sensor;
    let size = job.scene.sensors[sensor].item.sensor.film();
    let reference = Reference::new(size, pixels).map_err(fail)?;
    let loss = job.optimize()?.map_or(Loss::L2, |o| o.loss);
    let (scene, views) = (job.scene.clone(), vec![View { sensor, reference }]);
    let mut fit = Fit::new(scene, job.parameters.clone(), views, loss, job.settings.clone())
        .map_err(|e| job.blame(&e))?;
    let values: Vec<f64> = job.parameters.iter().map(|p| p.value).collect();
    monitor.stage("gradient", 0.0, 1.0);
    let seen = fit.evaluate(&values, job.settings.spp, job.settings.seed, monitor);
    Ok(seen.map_err(|e| job.blame(&e))?.map(|seen| seen.gradient()))
}

fn of_adjoint(rendering: &Rendering, adjoint: &[Rgb]) -> Vec<f64> {
    let product = |d: &drt_estimators::Derivative| -> f64 {
        d.total.pixels.iter().zip(adjoint).map(|(p, a)| p.mean.dot(*a)).sum()
    };
    rendering.derivatives.iter().map(product).collect()
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
