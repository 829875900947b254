//! `drt grad --loss` and `--adjoint`: the gradient of a loss by the parameters.

use std::path::{Path, PathBuf};

use drt_estimators::fit::{Collector, Fit, View};
use drt_estimators::loss::Loss;
use drt_estimators::{GradientBatch, SceneGradient, Shard, Target, gradient_in_batches};
use drt_math::Rgb;

use super::console;
use super::derivatives::derivatives;
use super::destinations::{Destinations, check_ending};
use super::fingerprint::Fingerprint;
use super::monitor::Monitor;
use super::options::{GradOptions, Options};
use super::outputs::{Outputs, name_written, output_or_beside};
use super::shard_file::{Batch, ShardFile, Sums, Total};
use super::{Outcome, run, shard, stop, targets};
use crate::error::Place;
use crate::files::image::read_picture;
use crate::files::npy::{write_npy, write_npy_bytes};
use crate::prepared::gradient::{by_parameters, collect, collectors};
use crate::prepared::independent_seed;
use crate::{CliError, Job, ParameterGroup};

/// Writes the gradient where `--output` says: one number per parameter in the job's order, then those
/// of each group.
pub(super) fn run(options: &GradOptions) -> Result<Outcome, CliError> {
    let common = &options.common;
    let look = common.look.given();
    refuse_with_gradient([
        ("--terms", options.terms),
        ("--digest", common.digest.is_some()),
        ("--preview", common.preview.is_some()),
        ("--loss", options.loss.is_some() && options.adjoint.is_some()),
        ("--seconds", common.seconds.is_some()),
        ("--target-error", common.target_error.is_some()),
        (look.unwrap_or_default(), look.is_some()),
    ])?;
    let given = common;
    if options.shard.is_some() && given.output.is_none() {
        return Err(CliError::argument("a shard needs -o FILE.npy to be written to"));
    }
    let output = &output_or_beside(given, "npy");
    check_ending("-o", output, &["npy"])?;
    let common = &Options { output: Some(output.clone()), ..given.clone() };
    let mut job = run::open(common)?;
    if job.text.is_none() {
        return Err(CliError::argument(format!(
            "{} is a scene; a gradient needs a job, a .toml file with parameters",
            common.input.display()
        )));
    }
    let shard = options.shard;
    if shard.is_some() {
        shard::check(&job, common, "grad")?;
    }
    let asked_for = [options.loss.as_ref().and_then(Option::as_ref), options.adjoint.as_ref()];
    let named = job.optimize()?.map(|plan| plan.targets.iter().chain(plan.masks.iter().flatten()));
    let pictures = asked_for.into_iter().flatten().chain(named.into_iter().flatten());
    Destinations::new([("-o", Some(output.as_path()))]).spare(pictures.map(PathBuf::as_path))?;
    let (monitor, start) =
        (Monitor::new(common.changes.quiet), Outputs::new(common, &job, "grad")?);
    // Before the seed is changed for the gradient's own samples.
    let asked = job.clone();
    let found = match (&options.loss, &options.adjoint) {
        (Some(target), _) => of_loss(&mut job, options, target.as_deref(), &monitor)?,
        (None, Some(adjoint)) => {
            let adjoint = picture(&job, adjoint)?;
            of_adjoint(&mut job, options, adjoint, &monitor)?
        }
        (None, None) => None,
    };
    monitor.finish();
    let _writing = stop::writing();
    match (found, shard) {
        (None, _) => return Ok(Outcome::Interrupted),
        (Some(Found::Numbers(gradient)), _) => {
            write_npy(output, &gradient)?;
            unseen(&asked, &gradient).iter().for_each(console::note);
            name_written(given, output);
        }
        (Some(Found::Sums(sums, picture)), Some(shard)) => {
            let inputs = Fingerprint::of_job(&asked, "grad", &[&picture])?;
            let mut file = ShardFile::new(&asked, shard, inputs, "grad", *sums);
            start.measure(&mut file);
            write_npy_bytes(output, &file.bytes()?)?;
        }
        (Some(Found::Sums(..)), None) => {}
    }
    Ok(Outcome::Done)
}

/// Refuses options that say nothing about a gradient.
pub(super) fn refuse_with_gradient<'o>(
    options: impl IntoIterator<Item = (&'o str, bool)>,
) -> Result<(), CliError> {
    let given = options.into_iter().find_map(|(option, given)| given.then_some(option));
    given.map_or(Ok(()), |option| {
        Err(CliError::argument(format!("{option} does not go with a gradient")))
    })
}

/// What a gradient, or a shard of one, is.
enum Found {
    Numbers(Vec<f64>),
    /// With a hash of the picture that it is about.
    Sums(Box<Sums>, String),
}

/// Notes of groups that a loss does not depend on, as when nothing of them is in view.
fn unseen(job: &Job, gradient: &[f64]) -> Vec<String> {
    let mut rest = &gradient[job.parameters.len().min(gradient.len())..];
    let mut notes = Vec::new();
    for ParameterGroup { group, .. } in &job.groups {
        let (own, others) = rest.split_at(group.count(&job.scene).min(rest.len()));
        rest = others;
        if own.iter().all(|g| *g == 0.0) {
            notes.push(format!("note: group `{}`: its gradient is zero everywhere", group.name));
        }
    }
    notes
}

/// Tells pictures apart, and losses of them.
fn hash(loss: &str, picture: &impl std::fmt::Debug) -> String {
    let mut sum = Fingerprint::default();
    sum.add(loss.as_bytes());
    sum.add(format!("{picture:?}").as_bytes());
    sum.to_string()
}

/// By the job's own loss, where it names one, of a picture or of all that the job names.
fn of_loss(
    job: &mut Job,
    options: &GradOptions,
    target: Option<&Path>,
    monitor: &Monitor,
) -> Result<Option<Found>, CliError> {
    let plan = job.optimize()?;
    let loss = plan.map_or(Loss::L2, |plan| plan.loss);
    let views = match (target, plan) {
        (Some(target), plan) => vec![targets::instead(job, plan, target)?],
        (None, Some(plan)) => targets::views(job, plan)?,
        (None, None) => {
            let message =
                "it has no [optimize] with `targets`, and no [[view]]; expected `--loss FILE`";
            return Err(CliError::input(&Place::file(&job.path), message));
        }
    };
    // What shards add up has to be what one run samples.
    match (&views[..], options.shard) {
        ([view], _) if !job.groups.is_empty() && view.pose.is_empty() => {
            return by_its_image(job, options, &view.clone(), loss, monitor);
        }
        ([view], Some(shard)) if job.groups.is_empty() => {
            return halves_of_loss(job, shard, view.clone(), loss, monitor);
        }
        (_, Some(_)) => {
            let message = "--shard goes with one target or view, and with [[parameter_group]] where that has no pose";
            return Err(CliError::argument(message));
        }
        (_, None) => {}
    }
    monitor.stage("gradient", 0.0, 1.0);
    let mut fit = fit(job, views, loss)?;
    let seen = fit
        .evaluate(&values(job), job.spp(), job.settings.seed, monitor)
        .map_err(|e| job.blame(&e))?;
    Ok(seen.map(|seen| {
        let groups = (0..job.groups.len()).flat_map(|g| seen.group_gradient(g));
        Found::Numbers(seen.gradient().into_iter().chain(groups.copied()).collect())
    }))
}

fn fit(job: &Job, views: Vec<View>, loss: Loss) -> Result<Fit, CliError> {
    let groups = job.groups.iter().map(|g| g.group.clone()).collect();
    Fit::new(job.scene.clone(), job.parameters.clone(), views, loss, job.settings.clone())
        .and_then(|fit| fit.with_groups(groups))
        .map_err(|e| job.blame(&e))
}

fn values(job: &Job) -> Vec<f64> {
    job.parameters.iter().map(|p| p.value).collect()
}

/// By the derivative of the loss by an image, whose samples are not those of the gradient.
fn by_its_image(
    job: &mut Job,
    options: &GradOptions,
    view: &View,
    loss: Loss,
    monitor: &Monitor,
) -> Result<Option<Found>, CliError> {
    job.settings.sensor = view.sensor;
    let mut session = run::prepare_forward(job, &mut run::Shared::default())?;
    monitor.stage("image", 0.0, 0.3);
    let rendering = run::sample(&mut session, &options.common, job.spp(), monitor, monitor);
    if !rendering.complete {
        return Ok(None);
    }
    let image: Vec<Rgb> = rendering.image.pixels.iter().map(|p| p.mean).collect();
    job.settings.seed = independent_seed(job.settings.seed);
    of_adjoint(job, options, loss.adjoint(&image, &view.reference), monitor)
}

/// A shard of the two halves that the gradient by parameters is made of.
fn halves_of_loss(
    job: &Job,
    shard: Shard,
    view: View,
    loss: Loss,
    monitor: &Monitor,
) -> Result<Option<Found>, CliError> {
    let target = view.reference.clone();
    let mut fit = fit(job, vec![view], loss)?;
    let mut half = |k: usize| {
        monitor.stage("gradient", 0.5 * k as f64, 0.5 * (k + 1) as f64);
        fit.half_shard(&values(job), job.spp(), job.settings.seed, 0, k, shard, monitor)
            .map_err(|e| job.blame(&e))
    };
    let Some((a, b)) = half(0)?.zip(half(1)?) else { return Ok(None) };
    let hash = hash(&format!("{loss:?}"), &target);
    let sums = Sums::Halves { halves: Box::new([a, b]), loss, target };
    Ok(Some(Found::Sums(Box::new(sums), hash)))
}

/// Forward for the parameters, in reverse for the groups.
fn of_adjoint(
    job: &mut Job,
    options: &GradOptions,
    adjoint: Vec<Rgb>,
    monitor: &Monitor,
) -> Result<Option<Found>, CliError> {
    let (mut numbers, mut images) = (Vec::new(), None);
    if !job.parameters.is_empty() {
        let shared = &mut run::Shared::default();
        if let Some(shard) = options.shard {
            let mut session = run::prepare(job, &job.parameters, shared)?;
            let Some(sums) = shard::sums(&mut session, job, shard, "gradient", monitor)? else {
                return Ok(None);
            };
            images = Some(sums);
        } else {
            let rendering = derivatives(job, &options.common, monitor, 0.6, shared)?;
            if !rendering.complete {
                return Ok(None);
            }
            numbers.extend(by_parameters(&rendering, &adjoint));
        }
    }
    let mut batches = Vec::new();
    if !job.groups.is_empty() {
        monitor.stage("gradient in reverse", 0.6, 1.0);
        let mut total = Total::default();
        let each = |collectors: &[Collector], batch: GradientBatch| {
            let GradientBatch { number, pixels, of_pixels, boundary, of_boundary } = batch;
            let of = [pixels, boundary];
            if options.shard.is_some() {
                let [pixels, boundary] = of.map(|gradient| {
                    let mut sums = vec![0.0; count(job)];
                    collect_all(job, collectors, &gradient, &mut sums);
                    sums
                });
                batches.push(Batch { number, pixels, of_pixels, boundary, of_boundary });
            } else if let Some(sums) = total.next(count(job), of_pixels, of_boundary) {
                let parts = of.iter().zip(sums);
                parts.for_each(|(gradient, sums)| collect_all(job, collectors, gradient, sums));
            }
        };
        if !in_reverse(job, options.shard, &adjoint, monitor, each)? {
            return Ok(None);
        }
        let found = total.numbers();
        numbers = if numbers.is_empty() { found } else { [numbers, found].concat() };
    }
    if monitor.interrupted() {
        return Ok(None);
    }
    Ok(Some(match options.shard {
        None => Found::Numbers(numbers),
        Some(_) => {
            let hash = hash("", &adjoint);
            Found::Sums(Box::new(Sums::Gradient { adjoint, images, batches }), hash)
        }
    }))
}

/// The number of unknowns of all groups.
fn count(job: &Job) -> usize {
    job.groups.iter().map(|g| g.group.count(&job.scene)).sum()
}

/// Adds the groups' parts of a gradient to numbers for all unknowns.
fn collect_all(
    job: &Job,
    collectors: &[Collector],
    gradient: &SceneGradient,
    mut numbers: &mut [f64],
) {
    let own = job.groups.iter().map(|group| {
        let (own, rest) = core::mem::take(&mut numbers).split_at_mut(group.group.count(&job.scene));
        numbers = rest;
        own
    });
    collect(collectors, gradient, own);
}

/// The gradient by the groups, batch by batch; false when it was interrupted.
fn in_reverse(
    job: &Job,
    shard: Option<Shard>,
    adjoint: &[Rgb],
    monitor: &Monitor,
    mut each: impl FnMut(&[Collector], GradientBatch),
) -> Result<bool, CliError> {
    let scene = job.at_values(&job.scene)?;
    let wanted: Vec<Target> = job.groups.iter().map(|g| g.group.wanted()).collect();
    let collectors = collectors(job, job.groups.iter().map(|g| &g.group), &scene)?;
    let (settings, spp) = (&job.settings, job.spp());
    let mut each = |batch| each(&collectors, batch);
    gradient_in_batches(&scene, &wanted, settings, spp, adjoint, shard, monitor, &mut each)
        .map_err(|e| job.blame(&e))
}

/// An image of the film's size.
fn picture(job: &Job, path: &Path) -> Result<Vec<Rgb>, CliError> {
    let Some(sensor) = job.scene.sensors.get(job.settings.sensor) else {
        return Err(CliError::input(&Place::file(&job.scene_path), "the scene has no <sensor>"));
    };
    Ok(read_picture(path, sensor.item.sensor.film())?.linear())
}
