//! From options to a finished rendering.

use std::path::Path;
use std::time::Instant;

use drt_estimators::{Control, Layer, PreparedCache, Rendering, Session, finite_differences};
use drt_motion::Parameter;

use super::console;
use super::monitor::Monitor;
use super::noise::largest_noise;
use super::options::{Changes, Options};
use crate::job::{depth, read_job_by};
use crate::scene_xml::SceneReader;
use crate::wording::shown;
use crate::{CliError, Job};

/// Samples per pixel of the first pass where time or noise decides when to stop; later ones double.
const FIRST_PASS: u32 = 4;

/// What jobs of one scene in a row share: its files are read once, and what was prepared is used again.
#[derive(Default)]
pub(super) struct Shared {
    scenes: SceneReader,
    prepared: PreparedCache,
}

/// Opens the input and lays the options over it.
pub(super) fn open(options: &Options) -> Result<Job, CliError> {
    open_shared(options, &mut Shared::default())
}

/// The same, with what an earlier job may have read.
pub(super) fn open_shared(options: &Options, shared: &mut Shared) -> Result<Job, CliError> {
    let mut job = read_changed(&options.input, &options.changes, &mut shared.scenes)?;
    if let Some(spp) = options.spp {
        job.set_spp(spp);
    }
    if let Some(sampling) = options.sampling {
        job.settings.sampling = sampling.into();
    }
    Ok(job)
}

/// Opens a scene or job with changes.
pub(super) fn open_changed(input: &Path, changes: &Changes) -> Result<Job, CliError> {
    read_changed(input, changes, &mut SceneReader::default())
}

fn read_changed(
    input: &Path,
    changes: &Changes,
    scenes: &mut SceneReader,
) -> Result<Job, CliError> {
    let overrides = changes.overrides();
    let is_job = input.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let mut job = if is_job {
        read_job_by(input, &overrides, scenes)?
    } else {
        changes.refuse_set(input)?;
        Job::read_scene_by(input, &overrides.defaults, scenes)?
    };
    if !changes.quiet {
        for warning in &job.warnings {
            console::note(format_args!("drt: warning: {}", shown(&warning.to_string())));
        }
    }
    if let Some(name) = &changes.sensor {
        job.select_sensor(name)?;
    }
    if let Some(film) = changes.size {
        job.resize(job.settings.sensor, film)?;
    }
    let settings = &mut job.settings;
    settings.seed = changes.seed.unwrap_or(settings.seed);
    settings.threads = changes.threads.map_or(settings.threads, usize::from);
    if let Some(value) = changes.max_depth {
        let depth = depth(value).map_err(|e| CliError::argument(format!("--max-depth: {e}")))?;
        settings.max_depth = depth;
    }
    Ok(job)
}

/// Opens an input that must be a job with derivatives that can be computed.
pub(super) fn open_with_parameters(options: &Options) -> Result<Job, CliError> {
    let job = open_job(options)?;
    job.require_derivatives()?;
    Ok(job)
}

/// Opens an input that must be a job.
pub(super) fn open_job(options: &Options) -> Result<Job, CliError> {
    let job = open(options)?;
    if job.text.is_none() {
        return Err(CliError::argument(format!(
            "{} is a scene; derivatives need a job, a .toml file with parameters",
            options.input.display()
        )));
    }
    Ok(job)
}

/// Prepares a job with derivatives by some of its parameters.
pub(super) fn prepare(
    job: &Job,
    parameters: &[Parameter<String>],
    shared: &mut Shared,
) -> Result<Session, CliError> {
    job.session(&job.scene, parameters, &job.settings, &mut shared.prepared)
}

/// Prepares the image alone, at the parameters' values.
pub(super) fn prepare_forward(job: &Job, shared: &mut Shared) -> Result<Session, CliError> {
    let scene = job.at_values(&job.scene)?;
    job.session(&scene, &[], &job.settings, &mut shared.prepared)
}

/// Finite differences of every parameter; `None` when they were interrupted.
pub(super) fn differences(
    job: &Job,
    spp: u32,
    step: f64,
    monitor: &Monitor,
) -> Result<Option<Vec<Layer>>, CliError> {
    let layers = finite_differences(&job.scene, &job.parameters, &job.settings, spp, step, monitor)
        .map_err(|e| job.blame(&e))?;
    Ok((layers.len() == job.parameters.len()).then_some(layers))
}

/// Tells which differences look to one side.
pub(super) fn tell_one_sided(job: &Job, quiet: bool) -> Result<(), CliError> {
    let step = job.settings.step;
    let found = drt_estimators::one_sided_differences(&job.scene, &job.parameters, step);
    for (name, order) in found.map_err(|e| job.blame(&e))? {
        if !quiet {
            let order = if order == 1 { "first" } else { "second" };
            console::note(format_args!(
                "drt: finite differences by `{name}` look to one side and are of {order} order: the range of what it \
                 changes ends within a step"
            ));
        }
    }
    Ok(())
}

/// Samples until the options say that it is enough, by the monitor's stages, and under this control, which may be the monitor too.
pub(super) fn sample(
    session: &mut Session,
    options: &Options,
    spp: u32,
    monitor: &Monitor,
    control: &dyn Control,
) -> Rendering {
    let by_count = options.seconds.is_none() && options.target_error.is_none();
    if by_count {
        session.run(spp, control);
        return session.rendering();
    }
    let start = Instant::now();
    let limit = options.spp.unwrap_or(u32::MAX);
    let mut pass = u32::min(FIRST_PASS, limit);
    let mut done = 0;
    loop {
        let going = session.run(pass, control);
        let rendering = session.rendering();
        done += pass;
        let mut left = limit - done;
        let mut part = f64::from(done) / f64::from(limit);
        if let Some(seconds) = options.seconds {
            let elapsed = start.elapsed().as_secs_f64();
            // A negative or oversized number saturates.
            let affordable = (seconds - elapsed) * f64::from(done) / elapsed;
            left = u32::min(left, affordable as u32);
            part = part.max(elapsed / seconds);
        }
        if let Some(target) = options.target_error {
            // Noise falls with the square root of the number of samples.
            let needed = (largest_noise(&rendering) / target).powi(2);
            let missing = (f64::from(done) * (needed - 1.0)).ceil();
            left = u32::min(left, missing as u32);
            part = part.max(1.0 / needed.max(1.0));
        }
        if !going || left == 0 {
            return rendering;
        }
        // Mirrored pairs of image points are not torn apart.
        pass = u32::min(u32::min(left, done).next_multiple_of(2), limit - done);
        monitor.stage(&format!("{done} spp"), part, 2.0 * part);
    }
}
