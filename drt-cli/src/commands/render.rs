//! `drt render`: the image alone.

use drt_estimators::{Control, Rendering};

use super::console;
use super::growing::Growing;
use super::monitor::Monitor;
use super::options::{Options, RenderOptions};
use super::outputs::{Outputs, name_written, output_or_beside};
use super::run::{self, Shared};
use super::{Outcome, noted, shard};
use crate::{CliError, Job};

pub(super) fn run(options: &RenderOptions) -> Result<Outcome, CliError> {
    let RenderOptions { shard, watch, common: given } = options;
    let watch = *watch;
    let job = run::open(given)?;
    if let Some(shard) = shard {
        return shard::images(&job, given, "render", *shard);
    }
    let output = output_or_beside(given, "exr");
    let options = &mut Options { output: Some(output.clone()), ..given.clone() };
    let beside = output.with_extension("png");
    if watch && beside != output {
        options.preview.get_or_insert(beside);
    }
    let outputs = Outputs::of_images(options, &job, "render")?;
    let monitor = Monitor::new(options.changes.quiet);
    let rendering = if watch {
        let path = options.preview.as_ref().unwrap_or(&output);
        let size = job.scene.sensors[job.settings.sensor].item.sensor.film();
        let growing = Growing::begin(&monitor, path, size, options.look.tone(None))?;
        if !options.changes.quiet {
            console::note(format_args!("{} grows while it is rendered", path.display()));
        }
        image(&job, options, &monitor, &growing, &mut Shared::default())
    } else {
        image(&job, options, &monitor, &monitor, &mut Shared::default())
    }?;
    monitor.finish();
    outputs.write(&job, &rendering, &[], &[])?;
    name_written(given, &output);
    Ok(noted(&rendering))
}

/// The image of a job at its parameters' values, by the monitor's stages, and under this control, which may be the monitor too.
pub(super) fn image(
    job: &Job,
    options: &Options,
    monitor: &Monitor,
    control: &dyn Control,
    shared: &mut Shared,
) -> Result<Rendering, CliError> {
    let mut session = run::prepare_forward(job, shared)?;
    if let Some(why) = session.plan().sampling.as_ref().filter(|_| !options.changes.quiet) {
        console::note(format_args!("drt: sampling is {why}"));
    }
    monitor.stage("render", 0.0, 1.0);
    let mut rendering = run::sample(&mut session, options, job.spp(), monitor, control);
    rendering.derivatives.clear();
    Ok(rendering)
}
