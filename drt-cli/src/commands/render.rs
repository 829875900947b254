//! `drt render`: the image alone.

use drt_estimators::Rendering;

use super::console;
use super::monitor::Monitor;
use super::options::{Options, RenderOptions};
use super::outputs::{Outputs, name_written, output_or_beside};
use super::run::{self, Shared};
use super::{Outcome, noted, shard};
use crate::{CliError, Job};

pub(super) fn run(options: &RenderOptions) -> Result<Outcome, CliError> {
    let (shard, given) = (options.shard, &options.common);
    let job = run::open(given)?;
    if let Some(shard) = shard {
        return shard::images(&job, given, "render", shard);
    }
    let output = output_or_beside(given, "exr");
    let options = &Options { output: Some(output.clone()), ..given.clone() };
    let outputs = Outputs::of_images(options, &job, "render")?;
    let monitor = Monitor::new(options.changes.quiet);
    let rendering = image(&job, options, &monitor, &mut Shared::default())?;
    monitor.finish();
    outputs.write(&job, &rendering, &[], &[])?;
    name_written(given, &output);
    Ok(noted(&rendering))
}

/// The image of a job at its parameters' values.
pub(super) fn image(
    job: &Job,
    options: &Options,
    monitor: &Monitor,
    shared: &mut Shared,
) -> Result<Rendering, CliError> {
    let mut session = run::prepare_forward(job, shared)?;
    if let Some(why) = session.plan().sampling.as_ref().filter(|_| !options.changes.quiet) {
        console::note(format_args!("drt: sampling is {why}"));
    }
    monitor.stage("render", 0.0, 1.0);
    let mut rendering = run::sample(&mut session, options, job.spp(), monitor);
    rendering.derivatives.clear();
    Ok(rendering)
}
