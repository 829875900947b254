//! The command line.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValue;
use clap::{Args, Parser, Subcommand, ValueEnum};
use drt_estimators::Shard;

use crate::job::keys::Sampling;
use crate::{CliError, Overrides, Tone, ToneCurve};

/// Differentiable rendering of surfaces and participating media.
#[derive(Debug, Parser)]
#[command(name = "drt", version)]
pub(super) struct CommandLine {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Render a scene, or a job's scene at its parameters' values.
    Render(RenderOptions),
    /// Render a job's scene and its derivative with respect to each parameter.
    Grad(GradOptions),
    /// Compare derivatives with finite differences; exit 1 when they disagree.
    Check(Options),
    /// Fit a job's parameters to target images.
    Optimize(OptimizeOptions),
    /// Measure error against run time at doubling sample counts.
    Bench(BenchOptions),
    /// Render many scenes and jobs, each into files of its own; go on where a killed run stopped.
    Batch(BatchOptions),
    /// Merge the shards of a render or gradient into the result of the run in one piece.
    Merge(MergeOptions),
    /// Show what a scene or job holds, and what will run.
    Info(InfoOptions),
    /// Make a picture to look at of the layers of an OpenEXR file.
    Preview(PreviewOptions),
    /// Show an image file in the terminal, with the layers of an OpenEXR file side by side.
    View(ViewOptions),
    /// Print what completes commands in a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or write those of all commands into a folder.
    Man {
        /// The folder.
        #[arg(short, long, value_name = "FOLDER")]
        output: Option<PathBuf>,
    },
}

#[derive(Args, Debug)]
pub(super) struct PreviewOptions {
    /// What `drt` wrote, or any other image.
    pub(super) input: PathBuf,
    /// Where to write the picture; default: beside the image, as .png.
    #[arg(short, long, value_name = "FILE.png")]
    pub(super) output: Option<PathBuf>,
    #[command(flatten)]
    pub(super) layers: Layers,
}

#[derive(Args, Debug)]
pub(super) struct ViewOptions {
    /// An image file: OpenEXR, PNG, JPEG, BMP, PFM or Radiance (.hdr).
    pub(super) input: PathBuf,
    /// Width of the picture in characters. Default: as wide as it has pixels and the terminal has room for.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) width: Option<u16>,
    #[command(flatten)]
    pub(super) layers: Layers,
}

/// Which layers of a file are shown, and how.
#[derive(Args, Debug)]
pub(super) struct Layers {
    /// Only this layer, such as d_NAME (`image` for the image itself); may be repeated. Default: all but standard errors.
    #[arg(long = "layer", value_name = "NAME")]
    pub(super) names: Vec<String>,
    #[command(flatten)]
    pub(super) look: Look,
}

#[derive(Args, Debug)]
pub(super) struct InfoOptions {
    /// A scene (.xml) or a job (.toml).
    pub(super) input: PathBuf,
    /// Where to write what is shown, as JSON; `-` is the standard output, where it takes the place of the tables.
    #[arg(long, value_name = "FILE.json")]
    pub(super) digest: Option<PathBuf>,
    /// Samples per pixel, as the plan would have them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,
    /// How paths are found, instead of as the job says.
    #[arg(long, value_name = "KIND")]
    pub(super) sampling: Option<Sampling>,
    #[command(flatten)]
    pub(super) changes: Changes,
}

/// How light is shown in PNG pictures.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct Look {
    /// Exposure of PNG pictures in stops, at 0 of which radiance 1 is white. Default: 0 for -o FILE.png, and for other pictures what
    /// their light needs.
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true)]
    pub(super) exposure: Option<f64>,
    /// Tone curve of PNG pictures.
    #[arg(long, value_name = "CURVE")]
    pub(super) tonemap: Option<ToneCurve>,
}

impl Look {
    /// As asked for, with another exposure where none is.
    pub(super) fn tone(self, exposure: Option<f64>) -> Tone {
        Tone { exposure: self.exposure.or(exposure), curve: self.tonemap.unwrap_or_default() }
    }

    /// The option that is given, if any.
    pub(super) fn given(self) -> Option<&'static str> {
        let exposure = self.exposure.map(|_| "--exposure");
        exposure.or(self.tonemap.map(|_| "--tonemap"))
    }
}

impl ValueEnum for ToneCurve {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Srgb, Self::Aces]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self {
            Self::Srgb => ("srgb", "Straight, cut off at white"),
            Self::Aces => ("aces", "The shape of film"),
        };
        Some(PossibleValue::new(name).help(help))
    }
}

/// What the commands on one scene or job take.
#[derive(Args, Clone, Debug)]
pub(super) struct Options {
    /// A scene (.xml) or a job (.toml).
    pub(super) input: PathBuf,
    /// Where to write images and standard errors, as OpenEXR (.exr), or a picture of them (.png). Default of `render` and `grad`: beside
    /// the input, under its name.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Where to write a summary, as JSON; `-` is the standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(super) digest: Option<PathBuf>,
    /// Where to write a picture to look at.
    #[arg(long, value_name = "FILE.png")]
    pub(super) preview: Option<PathBuf>,
    #[command(flatten)]
    pub(super) look: Look,
    /// Samples per pixel.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,
    /// Stop after this time.
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true)]
    pub(super) seconds: Option<f64>,
    /// Stop when the relative noise of every image is below this.
    #[arg(long, value_name = "E", value_parser = positive, allow_negative_numbers = true)]
    pub(super) target_error: Option<f64>,
    /// How paths are found, instead of as the job says.
    #[arg(long, value_name = "KIND")]
    pub(super) sampling: Option<Sampling>,
    #[command(flatten)]
    pub(super) changes: Changes,
}

impl ValueEnum for Sampling {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Unidirectional, Self::Bidirectional, Self::Auto]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self {
            Self::Unidirectional => ("unidirectional", "From the camera"),
            Self::Bidirectional => ("bidirectional", "From the camera and from emitters"),
            Self::Auto => ("auto", "What a pilot finds to take less work"),
        };
        Some(PossibleValue::new(name).help(help))
    }
}

/// What every command may change about a scene or job.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct Changes {
    /// Same seed, same pixels.
    #[arg(long, value_name = "N")]
    pub(super) seed: Option<u64>,
    /// Threads; 0, or none given, for all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(..=1024))]
    pub(super) threads: Option<u16>,
    /// Size of the image.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(super) size: Option<[u32; 2]>,
    /// Path depth; 1 is directly seen light, -1 is unlimited.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(super) max_depth: Option<i64>,
    /// The camera, by id or as in `sensor[1]`.
    #[arg(long, value_name = "ID")]
    pub(super) sensor: Option<String>,
    /// No progress and no summary.
    #[arg(long)]
    pub(super) quiet: bool,
    /// Value of a `<default>` of the scene.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = assignment)]
    defaults: Vec<(String, String)>,
    /// Value of a key of the job, such as `parameter.NAME.value=0.3`.
    #[arg(long, value_name = "KEY=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,
}

#[derive(Args, Debug)]
pub(super) struct RenderOptions {
    #[command(flatten)]
    pub(super) common: Options,
    /// Write what is finished of the picture about once a second while it is rendered: to --preview, by default beside the image, as .png.
    #[arg(long, conflicts_with = "shard")]
    pub(super) watch: bool,
    /// Take only this part of the samples, to be merged with the others: `3/8` is the third of eight.
    #[arg(long, value_name = "K/N", value_parser = shard)]
    pub(super) shard: Option<Shard>,
}

#[derive(Args, Debug)]
pub(super) struct MergeOptions {
    /// What `drt render` or `drt grad` wrote with `--shard`, in any order.
    #[arg(required = true)]
    pub(super) shards: Vec<PathBuf>,
    /// Where to write the result: an OpenEXR file (.exr) or a picture (.png) of images, an NPY file (.npy) of a gradient.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Where to write a summary, as JSON; `-` is the standard output.
    #[arg(long, value_name = "FILE.json")]
    pub(super) digest: Option<PathBuf>,
    /// Where to write a picture to look at.
    #[arg(long, value_name = "FILE.png")]
    pub(super) preview: Option<PathBuf>,
    #[command(flatten)]
    pub(super) look: Look,
    /// Merge what there is, though shards are missing: unbiased, with wider errors.
    #[arg(long)]
    pub(super) partial: bool,
    /// No summary.
    #[arg(long)]
    pub(super) quiet: bool,
}

#[derive(Args, Debug)]
pub(super) struct GradOptions {
    #[command(flatten)]
    pub(super) common: Options,
    /// Take only this part of the samples, to be merged with the others: `3/8` is the third of eight.
    #[arg(long, value_name = "K/N", value_parser = shard)]
    pub(super) shard: Option<Shard>,
    /// Store each term of a derivative in a layer of its own.
    #[arg(long)]
    pub(super) terms: bool,
    /// Write the gradient of a loss, as NPY, instead of images: of that of this target image, or of all targets or views that the
    /// job names.
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    pub(super) loss: Option<Option<PathBuf>>,
    /// The same for a loss of which this is the derivative by every pixel.
    #[arg(long, value_name = "FILE.exr")]
    pub(super) adjoint: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(super) struct OptimizeOptions {
    #[command(flatten)]
    pub(super) common: Options,
    /// Steps to take, instead of the job's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) iterations: Option<u32>,
    /// Begin anew, whatever the checkpoint says.
    #[arg(long)]
    pub(super) restart: bool,
}

#[derive(Args, Debug)]
pub(super) struct BenchOptions {
    /// Jobs (.toml) or scenes (.xml) to measure.
    #[arg(required = true)]
    pub(super) inputs: Vec<PathBuf>,
    /// Image, as of `drt grad` with many samples, that errors are measured against.
    #[arg(long, value_name = "FILE.exr")]
    pub(super) reference: Option<PathBuf>,
    /// Most time for each estimator of each job.
    #[arg(long, value_name = "S", default_value = "10", value_parser = positive, allow_negative_numbers = true)]
    pub(super) seconds: f64,
    /// Most samples per pixel.
    #[arg(long, value_name = "N", default_value = "65536", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: u32,
    /// Where to write every measurement, as comma-separated values.
    #[arg(long, value_name = "FILE.csv")]
    pub(super) csv: Option<PathBuf>,
    /// Where to draw errors against times, both logarithmic.
    #[arg(long, value_name = "FILE.svg")]
    pub(super) plot: Option<PathBuf>,
    #[command(flatten)]
    pub(super) changes: Changes,
}

#[derive(Args, Debug)]
pub(super) struct BatchOptions {
    /// Scenes (.xml), which are rendered, and jobs (.toml), which are differentiated where they have parameters.
    #[arg(required_unless_present = "list")]
    pub(super) inputs: Vec<PathBuf>,
    /// A file with a scene or job a line, with options of its own: `job.toml --set parameter.x.value=0.3 -o x3.exr`.
    #[arg(long, value_name = "FILE")]
    pub(super) list: Option<PathBuf>,
    /// The folder of the results NAME.exr and NAME.json, and of the log batch.jsonl.
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    pub(super) output: PathBuf,
    /// Write pictures to look at, NAME.png, too.
    #[arg(long)]
    pub(super) previews: bool,
    /// Only images, no derivatives.
    #[arg(long)]
    pub(super) forward: bool,
    /// Samples per pixel.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,
    #[command(flatten)]
    pub(super) changes: Changes,
}

/// What a line of a list may say.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
pub(super) struct ListLine {
    #[command(flatten)]
    pub(super) options: Options,
}

impl Options {
    /// A scene or job without options.
    pub(super) fn of(input: PathBuf) -> Self {
        Self {
            input,
            output: None,
            digest: None,
            preview: None,
            look: Look::default(),
            spp: None,
            seconds: None,
            target_error: None,
            sampling: None,
            changes: Changes::default(),
        }
    }
}

impl Changes {
    /// These changes where they are said, and else `general` ones.
    pub(super) fn over(self, general: &Self) -> Self {
        let both = |a: &[_], b: Vec<_>| a.iter().cloned().chain(b).collect();
        Self {
            seed: self.seed.or(general.seed),
            threads: self.threads.or(general.threads),
            size: self.size.or(general.size),
            max_depth: self.max_depth.or(general.max_depth),
            sensor: self.sensor.or_else(|| general.sensor.clone()),
            quiet: self.quiet || general.quiet,
            defaults: both(&general.defaults, self.defaults),
            set: both(&general.set, self.set),
        }
    }

    pub(super) fn overrides(&self) -> Overrides {
        let defaults = self.defaults.iter().cloned().collect();
        Overrides { set: self.set.clone(), defaults, ..Overrides::default() }
    }

    /// Refuses job keys where there is no job.
    pub(super) fn refuse_set(&self, scene: &Path) -> Result<(), CliError> {
        match self.set.first() {
            None => Ok(()),
            Some((key, _)) => Err(CliError::argument(format!(
                "--set {key}: {} is a scene, which has no job keys; use -D for its defaults",
                scene.display()
            ))),
        }
    }
}

fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => {
            Ok((key.trim().into(), value.trim().into()))
        }
        _ => Err("expected NAME=VALUE".into()),
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    let number = |s: &str| s.parse::<u32>().ok();
    let shard = text.split_once('/').and_then(|(k, n)| Shard::new(number(k)?, number(n)?));
    shard.ok_or_else(|| "expected one of several parts, from 1, such as 3/8".into())
}

fn finite(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| v.is_finite());
    value.ok_or_else(|| "expected a number".into())
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
    value.ok_or_else(|| "expected a positive number".into())
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |s: &str| s.parse::<u32>().ok().filter(|n| (1..=65_536).contains(n));
    let sides = text.split_once('x').and_then(|(w, h)| Some([side(w)?, side(h)?]));
    sides.ok_or_else(|| "expected two numbers of pixels such as 640x480".into())
}
