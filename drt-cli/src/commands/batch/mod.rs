//! `drt batch`: many jobs, one after the other, each into files of its own.
//!
//! What is finished is told by the results themselves: an image carries a hash of the inputs it was made from
//! and comes last of a job's files, whole or not at all. So a batch can be killed at any time and started again. The
//! log only tells what happened.

mod list;
mod log;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use self::list::Entry;
use self::log::{Event, Log};
use super::clock::Clock;
use super::derivatives::derivatives;
use super::destinations::{Destinations, check_ending};
use super::monitor::Monitor;
use super::options::BatchOptions;
use super::outputs::Outputs;
use super::run::{self, Shared};
use super::{Outcome, render};
use crate::commands::console;
use crate::commands::fingerprint::Fingerprint;
use crate::files::image::is_result_of;
use crate::wording::shown;
use crate::{CliError, Job};

/// The name of the log.
const LOG: &str = "batch.jsonl";

pub(super) fn run(options: &BatchOptions) -> Result<Outcome, CliError> {
    let entries = list::entries(options)?;
    let log = options.output.join(LOG);
    // Two jobs must not overwrite each other's results, nor the log.
    let written = written(&entries, &log);
    written.distinct()?;
    written
        .spare(entries.iter().map(|e| e.options.input.as_path()).chain(options.list.as_deref()))?;
    // What is done is known by the marks of its images.
    entries.iter().try_for_each(|e| check_ending("-o", e.output(), &["exr"]))?;
    for folder in folders(&entries, &options.output) {
        std::fs::create_dir_all(&folder).map_err(|e| CliError::write(&folder, e))?;
    }
    let batch = Batch {
        log: Log::open(&log)?,
        monitor: Monitor::new(options.changes.quiet),
        forward: options.forward,
        written,
    };
    let tally = batch.run(&entries)?;
    batch.monitor.finish();
    tally.tell(&entries, options.changes.quiet);
    Ok(match &tally {
        Tally { interrupted: true, .. } => Outcome::Interrupted,
        Tally { failed, .. } if !failed.is_empty() => Outcome::Failed,
        _ => Outcome::Done,
    })
}

/// The folders that results go to.
fn folders(entries: &[Entry], own: &Path) -> Vec<PathBuf> {
    let of = |e: &Entry| e.output().parent().map(Path::to_path_buf);
    let here = |p: PathBuf| if p.as_os_str().is_empty() { PathBuf::from(".") } else { p };
    let mut folders: Vec<PathBuf> =
        entries.iter().filter_map(of).chain([own.to_path_buf()]).map(here).collect();
    folders.sort();
    folders.dedup();
    folders
}

/// All files that a batch writes: the results of its jobs, and the log.
fn written(entries: &[Entry], log: &Path) -> Destinations {
    let results = entries.iter().flat_map(|entry| {
        let files = [&entry.options.output, &entry.options.digest, &entry.options.preview];
        files.map(|file| (entry.to_string(), file.as_deref()))
    });
    Destinations::new([("the log".to_owned(), Some(log))].into_iter().chain(results))
}

/// What became of the jobs.
#[derive(Default)]
struct Tally {
    finished: usize,
    skipped: usize,
    /// Which, and why.
    failed: Vec<(usize, CliError)>,
    interrupted: bool,
}

impl Tally {
    fn tell(&self, entries: &[Entry], quiet: bool) {
        for (i, error) in &self.failed {
            let message = shown(&entries[*i].blamed_for(&error.to_string()));
            console::note(format_args!("drt: error: {message}"));
        }
        if !quiet {
            let Self { finished, skipped, failed, interrupted } = self;
            let left = entries.len() - finished - skipped - failed.len();
            let rest = match interrupted {
                true => format!(", {left} left; the same command goes on from here"),
                false => String::new(),
            };
            console::note(format_args!(
                "{finished} finished, {skipped} were finished before, {} failed{rest}",
                failed.len()
            ));
        }
    }
}

/// How one job ended.
enum End {
    Finished,
    Skipped,
    Interrupted,
}

struct Batch {
    log: Log,
    monitor: Monitor,
    /// No derivatives.
    forward: bool,
    /// The files that all jobs write.
    written: Destinations,
}

impl Batch {
    fn run(&self, entries: &[Entry]) -> Result<Tally, CliError> {
        let (mut tally, mut shared, n) = (Tally::default(), Shared::default(), entries.len());
        for (i, entry) in entries.iter().enumerate() {
            let failed = match tally.failed.len() {
                0 => String::new(),
                f => format!(", {f} failed"),
            };
            let at = |i: usize| i as f64 / n as f64;
            let title = format!("{} of {n}{failed}, {entry}:", i + 1);
            self.monitor.job(&title, at(i), at(i + 1));
            // A job that breaks the program must not take the others along.
            let end = catch_unwind(AssertUnwindSafe(|| self.job(entry, &mut shared)));
            let end = end.unwrap_or_else(|_| {
                shared = Shared::default();
                Err(CliError::unsolved("an internal error; what it says is above"))
            });
            match end {
                Ok(End::Finished) => tally.finished += 1,
                Ok(End::Skipped) => tally.skipped += 1,
                Ok(End::Interrupted) => tally.interrupted = true,
                Err(error) => {
                    let message = error.to_string();
                    self.log.add(entry, Event { error: Some(&message), ..Event::new("failed") })?;
                    tally.failed.push((i, error));
                }
            }
            if tally.interrupted {
                break;
            }
        }
        Ok(tally)
    }

    fn job(&self, entry: &Entry, shared: &mut Shared) -> Result<End, CliError> {
        if self.monitor.interrupted() {
            return Ok(End::Interrupted);
        }
        let (clock, options) = (Clock::start(), &entry.options);
        let job = run::open_shared(options, shared)?;
        self.written.spare(job.inputs())?;
        let by_derivatives = !self.forward && !job.parameters.is_empty();
        let command = if by_derivatives { "grad" } else { "render" };
        let inputs = hash(&job, command, entry)?.to_string();
        let event = |event| Event { inputs: Some(&inputs), ..Event::new(event) };
        if is_finished(entry, &inputs) {
            self.log.add(entry, event("skipped"))?;
            return Ok(End::Skipped);
        }
        let warnings: Vec<String> = job.warnings.iter().map(ToString::to_string).collect();
        self.log.add(entry, Event { warnings: &warnings, ..event("started") })?;
        let outputs = Outputs::of_images(options, &job, command)?.of_inputs(inputs.clone());
        let rendering = if by_derivatives {
            job.require_derivatives()?;
            derivatives(&job, options, &self.monitor, 1.0, shared)?
        } else {
            render::image(&job, options, &self.monitor, &self.monitor, shared)?
        };
        if !rendering.complete {
            return Ok(End::Interrupted);
        }
        outputs.write(&job, &rendering, &[], &[])?;
        let seconds = Some(clock.seconds());
        self.log.add(entry, Event { seconds, ..event("finished") })?;
        Ok(End::Finished)
    }
}

fn hash(job: &Job, command: &str, entry: &Entry) -> Result<Fingerprint, CliError> {
    let options = &entry.options;
    let stop = format!("{:?} {:?}", options.seconds, options.target_error);
    Fingerprint::of_job(job, command, &[&stop])
}

/// True when all files of a job are there, of these inputs.
fn is_finished(entry: &Entry, inputs: &str) -> bool {
    let options = &entry.options;
    let others = [&options.digest, &options.preview];
    is_result_of(entry.output(), inputs) && others.into_iter().flatten().all(|p| p.is_file())
}
