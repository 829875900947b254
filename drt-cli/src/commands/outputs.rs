//! What a command leaves behind.

use std::path::{Path, PathBuf};

use drt_estimators::{Layer, Rendering, Tail};

use super::clock::Clock;
use super::console;
use super::destinations::{Destinations, check_ending, ends_with};
use super::noise::largest_noise;
use super::options::{Look, Options};
use super::shard_file::ShardFile;
use super::stop;
use crate::files::digest::{RunFacts, Verdict, digest, write_digest};
use crate::{CliError, Job, Provenance, Tone, write_exr, write_preview};

/// Measures a command from its start and writes its results.
#[derive(Clone)]
pub(super) struct Outputs {
    options: Options,
    command: &'static str,
    clock: Clock,
    /// The hash of the inputs, where the image shall tell.
    inputs: Option<String>,
    /// What of a shard goes along with the image.
    attachment: Option<Vec<u8>>,
}

impl Outputs {
    /// Starts the clock and refuses places that cannot be written, or that hold what the job was read from.
    pub(super) fn new(
        options: &Options,
        job: &Job,
        command: &'static str,
    ) -> Result<Self, CliError> {
        Files::of(options).check(job.inputs())?;
        let options = options.clone();
        Ok(Self { options, command, clock: Clock::start(), inputs: None, attachment: None })
    }

    /// Does what [`new`](Self::new) does for a command that writes images, and refuses names that end as no image does.
    pub(super) fn of_images(
        options: &Options,
        job: &Job,
        command: &'static str,
    ) -> Result<Self, CliError> {
        let outputs = Self::new(options, job, command)?;
        Files::of(options).check_images()?;
        Ok(outputs)
    }

    /// Marks the image as the result of inputs with this hash.
    pub(super) fn of_inputs(self, inputs: String) -> Self {
        Self { inputs: Some(inputs), ..self }
    }

    /// Puts what a shard has added up into the image's file.
    pub(super) fn with_shard(self, mut shard: ShardFile) -> Result<Self, CliError> {
        self.measure(&mut shard);
        Ok(Self { attachment: Some(shard.bytes()?), ..self })
    }

    /// Notes what a shard has cost so far.
    pub(super) fn measure(&self, shard: &mut ShardFile) {
        (shard.seconds, shard.cpu_seconds) = (self.clock.seconds(), self.clock.cpu_seconds());
        shard.threads = threads(self.options.changes.threads.map_or(0, usize::from));
    }

    /// Refuses to overwrite more than what the job was read from.
    pub(super) fn spare<'p>(
        &self,
        read: impl IntoIterator<Item = &'p Path>,
    ) -> Result<(), CliError> {
        Files::of(&self.options).destinations().spare(read)
    }

    /// The files that are asked for.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        let Options { output, digest, preview, .. } = &self.options;
        [output, digest, preview].into_iter().flatten().map(PathBuf::as_path)
    }

    /// Prints lines for people; the standard output may belong to the digest.
    pub(super) fn tell(&self, lines: &str) -> Result<(), CliError> {
        if self.options.digest.as_deref() == Some(Path::new("-")) {
            console::note(lines.trim_end());
            return Ok(());
        }
        console::print(lines)
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
        let seconds = self.clock.seconds();
        let threads = threads(job.settings.threads);
        let facts = RunFacts {
            command: self.command,
            scene: job.scene_path.display().to_string(),
            job: job.text.as_ref().map(|_| job.path.display().to_string()),
            seed: job.settings.seed,
            seconds,
            cpu_seconds: self.clock.cpu_seconds(),
            threads,
        };
        let provenance = Provenance {
            scene: facts.scene.clone(),
            job: facts.job.clone().zip(job.text.clone()),
            seed: facts.seed,
            seconds,
            inputs: self.inputs.clone(),
            attachment: self.attachment.clone(),
        };
        Files::of(&self.options).write(rendering, further, checks, &facts, &provenance)?;
        if !self.options.changes.quiet {
            summarize(rendering, seconds, self.options.target_error);
        }
        Ok(())
    }
}

/// The file that is named, or else one beside the input, under its name.
pub(super) fn output_or_beside(options: &Options, ending: &str) -> PathBuf {
    options.output.clone().unwrap_or_else(|| options.input.with_extension(ending))
}

/// Names the file that has been written, where the command line does not.
pub(super) fn name_written(options: &Options, path: &Path) {
    if options.output.is_none() && !options.changes.quiet {
        console::note(format_args!("written to {}", path.display()));
    }
}

/// Where results go.
pub(super) struct Files<'a> {
    pub(super) output: &'a Option<PathBuf>,
    pub(super) digest: &'a Option<PathBuf>,
    pub(super) preview: &'a Option<PathBuf>,
    pub(super) look: Look,
}

impl<'a> Files<'a> {
    fn of(options: &'a Options) -> Self {
        let Options { output, digest, preview, look, .. } = options;
        Self { output, digest, preview, look: *look }
    }
}

impl Files<'_> {
    /// Refuses images under names of something else, and a look for which there is no picture.
    pub(super) fn check_images(&self) -> Result<(), CliError> {
        let endings: [(&str, &Option<PathBuf>, &[&str]); 2] =
            [("-o", self.output, &["exr", "png"]), ("--preview", self.preview, &["png"])];
        for (option, path, known) in endings {
            path.as_ref().map_or(Ok(()), |path| check_ending(option, path, known))?;
        }
        let picture = self.output.as_ref().filter(|path| ends_with(path, "png"));
        match self.look.given().filter(|_| picture.or(self.preview.as_ref()).is_none()) {
            Some(option) => Err(CliError::argument(format!(
                "{option}: no picture is written; expected -o FILE.png or --preview FILE.png beside it"
            ))),
            None => Ok(()),
        }
    }

    /// Refuses places that cannot be written, or that hold something that is read.
    pub(super) fn check<'p>(
        &self,
        read: impl IntoIterator<Item = &'p Path>,
    ) -> Result<(), CliError> {
        let destinations = self.destinations();
        destinations.spare(read)?;
        destinations.check()
    }

    pub(super) fn destinations(&self) -> Destinations {
        Destinations::new([
            ("-o", self.output.as_deref()),
            ("--digest", self.digest.as_deref()),
            ("--preview", self.preview.as_deref()),
        ])
    }

    pub(super) fn write(
        &self,
        rendering: &Rendering,
        further: &[(String, &Layer)],
        checks: &[Verdict],
        facts: &RunFacts,
        provenance: &Provenance,
    ) -> Result<(), CliError> {
        let _writing = stop::writing();
        if let Some(path) = self.preview {
            write_preview(path, rendering, further, self.look.tone(None))?;
        }
        if let Some(path) = self.digest {
            let text = digest(rendering, facts, checks);
            if path.as_os_str() == "-" {
                console::print(format!("{text}\n"))?;
            } else {
                write_digest(path, &text)?;
            }
        }
        // The image comes last: what has it has everything.
        match self.output {
            Some(path) if ends_with(path, "png") => {
                write_preview(path, rendering, further, self.look.tone(Tone::PLAIN.exposure))
            }
            Some(path) => write_exr(path, rendering, further, provenance),
            None => Ok(()),
        }?;
        Ok(())
    }
}

/// Threads that are meant, where 0 is all.
fn threads(asked: usize) -> usize {
    match asked {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    }
}

/// Says of which images standard errors may be too small, since few samples make up most of their second moment.
fn warn_of_heavy_tails(rendering: &Rendering) {
    let derivatives = rendering.derivatives.iter().map(|d| (d.name.as_str(), &d.total));
    for (name, layer) in [("the image", &rendering.image)].into_iter().chain(derivatives) {
        let share = layer.tail.share();
        if share > Tail::HEAVY {
            console::note(format_args!(
                "note: {name}: one sample makes up {:.0} % of the second moment, so its standard errors may be too \
                 small; to check, take more samples, or another estimator or way to sample paths where there is one",
                100.0 * share
            ));
        }
    }
}

/// Says how a run ended that was to go on until its noise was below `target_error`, where one is given.
pub(super) fn summarize(rendering: &Rendering, seconds: f64, target_error: Option<f64>) {
    let [w, h] = rendering.image.size;
    let noise = 100.0 * largest_noise(rendering);
    let complete = if rendering.complete { "" } else { ", incomplete" };
    let spp = rendering.spp;
    console::note(format_args!(
        "{w}x{h}, {spp} spp, {seconds:.2} s, relative noise {noise:.2} %{complete}"
    ));
    if let Some(target) = target_error.filter(|target| rendering.complete && noise > 100.0 * target)
    {
        console::note(format_args!(
            "note: the noise is above the target error of {:.2} %: the time or the samples that were given ended first",
            100.0 * target
        ));
    }
    warn_of_heavy_tails(rendering);
    if rendering.non_finite > 0 {
        let count = rendering.non_finite;
        console::note(format_args!("warning: {count} contributions were not finite"));
        for example in &rendering.non_finite_examples {
            console::note(format_args!("  {example:?}"));
        }
    }
}
