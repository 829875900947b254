//! `--shard`: one part of the samples of a run, to be merged with the others.

use drt_estimators::{Estimate, EstimatorKind, Layer, Plan, Rendering, Shard, ShardSums, Tail};
use drt_math::Rgb;

use super::Outcome;
use super::destinations::check_ending;
use super::fingerprint::Fingerprint;
use super::monitor::Monitor;
use super::options::Options;
use super::outputs::Outputs;
use super::run::{self, Shared};
use super::shard_file::{ShardFile, Sums};
use super::stop;
use crate::{CliError, Job};

/// Refuses what a part of a run cannot have.
pub(super) fn check(job: &Job, options: &Options, command: &str) -> Result<(), CliError> {
    for (name, given) in
        [("seconds", options.seconds.is_some()), ("target-error", options.target_error.is_some())]
    {
        if given {
            return Err(CliError::argument(format!(
                "--{name} does not go with --shard: all shards must be of one number of samples"
            )));
        }
    }
    if command == "grad" && job.settings.estimator == EstimatorKind::FiniteDifference {
        return Err(CliError::argument("--shard: finite differences are not made in shards"));
    }
    Ok(())
}

/// A shard of an image, and of derivatives by `grad`.
pub(super) fn images(
    job: &Job,
    options: &Options,
    command: &'static str,
    shard: Shard,
) -> Result<Outcome, CliError> {
    check(job, options, command)?;
    let Some(output) = &options.output else {
        return Err(CliError::argument("a shard needs -o FILE.exr to be written to"));
    };
    let outputs = Outputs::of_images(options, job, command)?;
    check_ending("-o", output, &["exr"])?;
    let monitor = Monitor::new(options.changes.quiet);
    let name = format!("shard {shard}");
    let shared = &mut Shared::default();
    let sums = match command {
        "render" => sums(&mut run::prepare_forward(job, shared)?, job, shard, &name, &monitor)?,
        _ => sums(&mut run::prepare(job, &job.parameters, shared)?, job, shard, &name, &monitor)?,
    };
    monitor.finish();
    let Some(sums) = sums else { return Ok(Outcome::Interrupted) };
    let _writing = stop::writing();
    let rendering = alone(job, &sums);
    let inputs = Fingerprint::of_job(job, command, &[])?;
    let file = ShardFile::new(job, shard, inputs, command, Sums::Images(sums));
    outputs.with_shard(file)?.write(job, &rendering, &[], &[])?;
    Ok(Outcome::Done)
}

/// What a shard adds up; `None` when it was interrupted.
pub(super) fn sums(
    session: &mut drt_estimators::Session,
    job: &Job,
    shard: Shard,
    name: &str,
    monitor: &Monitor,
) -> Result<Option<ShardSums>, CliError> {
    monitor.stage(name, 0.0, 1.0);
    session
        .run_shard(job.spp(), job.settings.seed, shard, monitor)
        .map_err(|e| CliError::argument(format!("--shard: {e}")))
}

/// The image that a shard makes by itself; pixels are not numbers where that tells nothing.
fn alone(job: &Job, sums: &ShardSums) -> Rendering {
    if let Ok(merged) = ShardSums::merge(std::slice::from_ref(sums)) {
        return merged.rendering;
    }
    let size = job.scene.sensors[job.settings.sensor].item.sensor.film();
    let unknown = Estimate { mean: Rgb::splat(f64::NAN), stderr: Rgb::splat(f64::INFINITY) };
    let image = Layer {
        size,
        pixels: vec![unknown; size[0] as usize * size[1] as usize],
        blocks: vec![unknown; drt_estimators::BLOCKS * drt_estimators::BLOCKS],
        total: unknown,
        tail: Tail::default(),
    };
    Rendering {
        image,
        derivatives: Vec::new(),
        plan: Plan::default(),
        counters: Default::default(),
        non_finite: 0,
        non_finite_examples: Vec::new(),
        spp: 0,
        complete: false,
    }
}
