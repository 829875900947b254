//! What a command leaves behind.

use std::path::Path;
use std::time::Instant;

use drt_estimators::{Layer, Rendering};

use super::noise::largest_noise;
use super::options::Options;
use crate::digest::{RunFacts, Verdict, digest, write_digest};
use crate::{CliError, Job, Provenance, check_target, write_exr, write_preview};

/// Measures a command from its start and writes its results.
pub(super) struct Outputs<'a> {
    options: &'a Options,
    command: &'static str,
    start: Instant,
}

impl<'a> Outputs<'a> {
    /// Starts the clock and refuses places that cannot be written.
    pub(super) fn new(options: &'a Options, command: &'static str) -> Result<Self, CliError> {
        let files = [&options.output, &options.digest, &options.preview];
        for path in files.into_iter().flatten().filter(|p| p.as_os_str() != "-") {
            check_target(path)?;
        }
        Ok(Self { options, command, start: Instant::now() })
    }

    /// True when the standard output belongs to the digest.
    pub(super) fn digest_on_stdout(&self) -> bool {
        self.options.digest.as_deref() == Some(Path::new("-"))
    }

    /// Writes what was asked for. `further` images, such as finite differences, go into the image
    /// files under their names, `checks` into the digest.
    pub(super) fn write(
        &self,
        job: &Job,
        rendering: &Rendering,
        further: &[(String, &Layer)],
        checks: &[Verdict],
    ) -> Result<(), CliError> {
        let seconds = self.start.elapsed().as_secs_f64();
        let threads = match job.settings.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        let facts = RunFacts {
            command: self.command,
            scene: job.scene_path.display().to_string(),
            job: job.text.as_ref().map(|_| job.path.display().to_string()),
            seed: job.settings.seed,
            seconds,
            cpu_seconds: cpu_seconds().unwrap_or(seconds),
            threads,
        };
        if let Some(path) = &self.options.output {
            let provenance = Provenance {
                scene: facts.scene.clone(),
                job: facts.job.clone().zip(job.text.clone()),
                seed: facts.seed,
                seconds,
            };
            write_exr(path, rendering, further, &provenance)?;
        }
        if let Some(path) = &self.options.preview {
            write_preview(path, rendering, further)?;
        }
        if let Some(path) = &self.options.digest {
            write_digest(path, &digest(rendering, &facts, checks))?;
        }
        if !self.options.quiet {
            summarize(rendering, seconds);
        }
        Ok(())
    }
}

fn summarize(rendering: &Rendering, seconds: f64) {
    let [w, h] = rendering.image.size;
    let noise = 100.0 * largest_noise(rendering);
    let complete = if rendering.complete { "" } else { ", incomplete" };
    let spp = rendering.spp;
    eprintln!("{w}x{h}, {spp} spp, {seconds:.2} s, relative noise {noise:.2} %{complete}");
    if rendering.non_finite > 0 {
        eprintln!("warning: {} contributions were not finite", rendering.non_finite);
        for example in &rendering.non_finite_examples {
            eprintln!("  {example:?}");
        }
    }
}

/// Processor time of this process so far, user and system; `None` where Linux's account is missing.
fn cpu_seconds() -> Option<f64> {
    /// Clock ticks per second in this file, whatever the kernel counts inside.
    const USER_HZ: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is the program's name in parentheses and may contain anything.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / USER_HZ)
}
