//! Renders scenes of Mitsuba's test suite and compares them with the references beside them:
//!
//! ```sh
//! cargo build --release -p drt-cli
//! cargo run --release -p drt-cli --example scene_table -- --scenes DIR
//! ```
//!
//! A scene `DIR/…/NAME_INTEGRATOR.xml` has its reference in `refs/NAME_ref_rgb.exr` and the variance of
//! one sample of a pixel in `refs/NAME_ref_rgb_var.exr`, both as Mitsuba's own tests write them. The
//! table says of each whether it loads, the rms and the largest z of 8×8 block means, their bias in
//! percent of the image's mean, the rms of what the reference's own numbers cannot show, in percent of a block, and seconds.
//! It exits with 1 where a scene does not load or disagrees.
//!
//! With `--again FOLDER` two more columns compare with images that Mitsuba makes today (`scene_table_again.py`): the rms z of these
//! and the reference, and of ours and these. Where the first is large and the second is not, the reference is off, and the table says so.
//!
//! References and their variances were taken in XYZ and stored as RGB. Variances mean something in XYZ only: as RGB they
//! come out below zero. Both images are compared there. The variances of ours are those of runs with other seeds.
//!
//! What a reference's own numbers cannot show does not count. They are means in single precision, to which samples were added
//! one by one: with steps of the size e at the sum of N samples, this adds an error of e²/12 for each sample where these vary by
//! more than e, but one that is the same each time where all are equal, even within N e/4 (32000 times 0.950456, the X of
//! white, gives 0.950745, which is in the reference of a white sky). Mean squares have the same error; a variance that it may have made does not tell
//! whether samples vary. Some means were then kept in half precision: every one of their
//! pixels is a triple of such numbers once it is taken back to XYZ, off by up to half a step. These errors are the same for pixels
//! that are equal but for them, and independent for others.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

use clap::Parser;
use drt_cli::{ExrFile, read_exr};
use drt_math::Moments;

/// Width of the blocks whose means are compared.
const BLOCK: u32 = 8;
/// Runs of other seeds that make an image.
const PARTS: u32 = 8;

#[derive(Parser)]
#[command(about = "Compares images of Mitsuba's test scenes with their references")]
struct Arguments {
    /// The folder to search, with all below it.
    #[arg(long)]
    scenes: PathBuf,
    /// Only scenes whose path holds this.
    #[arg(long, default_value = "")]
    only: String,
    /// Samples per pixel; by default two million in all, as Mitsuba's tests take.
    #[arg(long)]
    spp: Option<u32>,
    /// Samples per pixel of the references.
    #[arg(long, default_value_t = 32_000.0)]
    reference_spp: f64,
    /// A folder of images by Mitsuba as it is now, made by `scene_table_again.py`: NAME.SEED.exr.
    #[arg(long)]
    again: Option<PathBuf>,
    /// Where to keep the images, as NAME.SEED.exr; by default nowhere.
    #[arg(long)]
    keep: Option<PathBuf>,
    /// The program to render with; by default `drt` of the same build.
    #[arg(long)]
    drt: Option<PathBuf>,
}

struct Scene {
    path: PathBuf,
    name: String,
    reference: PathBuf,
    variance: PathBuf,
}

/// Of the block means, over the three channels.
struct Comparison {
    rms_z: f64,
    max_z: f64,
    /// Mean difference over the mean of the reference.
    bias: f64,
    /// Rms over blocks of the standard error by the reference's precision, over the mean of the reference.
    rounding: f64,
    agrees: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let mut scenes = Vec::new();
    find(&arguments.scenes, &mut scenes);
    scenes.sort_by(|a, b| a.path.cmp(&b.path));
    scenes.retain(|s| s.path.to_string_lossy().contains(&arguments.only));
    let again = if arguments.again.is_some() { "   mi-ref  ours-mi" } else { "" };
    println!(
        "{:44} {:>8} {:>8} {:>8} {:>8} {:>8}{again}",
        "scene", "rms z", "max z", "bias %", "ref ±%", "seconds"
    );
    let mut agreeing = 0;
    for scene in &scenes {
        let start = Instant::now();
        match compare(scene, &arguments) {
            Ok((c, again)) => {
                let off =
                    again.as_ref().is_some_and(|[theirs, ours]| !theirs.agrees && ours.agrees);
                agreeing += usize::from(c.agrees || off);
                let [bias, rounding] = [c.bias, c.rounding].map(|x| 100.0 * x);
                let seconds = start.elapsed().as_secs_f64();
                let mark = match (c.agrees, off) {
                    (true, _) => "",
                    (_, true) => "  the reference is off",
                    (_, false) => "  disagrees",
                };
                let again = again.map_or(String::new(), |[theirs, ours]| {
                    format!(" {:8.2} {:8.2}", theirs.rms_z, ours.rms_z)
                });
                let [rms, max] = [c.rms_z, c.max_z];
                println!(
                    "{:44} {rms:8.2} {max:8.2} {bias:8.2} {rounding:8.3} {seconds:8.1}{again}{mark}",
                    scene.name
                );
            }
            Err(message) => println!("{:44} {message}", scene.name),
        }
    }
    println!("{agreeing} of {} agree", scenes.len());
    if agreeing == scenes.len() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Collects the scenes with references below a folder.
fn find(folder: &Path, scenes: &mut Vec<Scene>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|e| e.path()) {
        if path.is_dir() {
            find(&path, scenes);
        } else if path.extension().is_some_and(|e| e == "xml") {
            scenes.extend(with_reference(path));
        }
    }
}

fn with_reference(path: PathBuf) -> Option<Scene> {
    let stem = path.file_stem()?.to_str()?;
    let base = stem.rsplit_once('_').map_or(stem, |(base, _)| base);
    let folder = path.parent()?;
    let file = |end: &str| folder.join("refs").join(format!("{base}_ref_rgb{end}.exr"));
    let (reference, variance) = (file(""), file("_var"));
    let name = format!("{}/{stem}", folder.file_name()?.to_str()?);
    (reference.exists() && variance.exists()).then_some(Scene { path, name, reference, variance })
}

/// Ours with the reference; and Mitsuba's of today with the reference, ours with that.
type Comparisons = (Comparison, Option<[Comparison; 2]>);

fn compare(scene: &Scene, arguments: &Arguments) -> Result<Comparisons, String> {
    let read = |path: &Path| plain(&read_exr(path).map_err(|e| e.to_string())?);
    let (expected, spread) = (read(&scene.reference)?, read(&scene.variance)?);
    let size = expected.size;
    let pixels = expected.pixels.len() as u32;
    let spp = arguments.spp.unwrap_or_else(|| 2_000_000 / pixels.max(1)).max(PARTS) / PARTS;
    let ours = moments(size, |seed| plain(&render(scene, spp, seed, arguments)?))?;
    let again = arguments
        .again
        .as_ref()
        .map(|folder| moments(size, |seed| read(&folder.join(file_name(scene, seed)))));
    let again = again.transpose()?;
    let precision = Precision::of(&expected.pixels, arguments.reference_spp);
    let rounding = |pixels: &[usize], c: usize| {
        let (mut alike, mut others) = (BTreeMap::<i64, f64>::new(), 0.0);
        for i in pixels {
            let mean = expected.pixels[*i][c];
            match precision.of_pixel(mean, spread.pixels[*i][c]) {
                Rounding::Random(variance) => others += variance,
                Rounding::Systematic(variance) => {
                    *alike.entry(precision.class(mean)).or_insert(0.0) += variance.sqrt();
                }
            }
        }
        others + alike.values().map(|error| error * error).sum::<f64>()
    };
    let of_one = |i: usize, c: usize| spread.pixels[i][c].max(0.0);
    let with_reference = |image: &Image| {
        let sample = |i: usize, c: usize| Sample {
            difference: image.pixels[i][c].mean() - expected.pixels[i][c],
            expected: expected.pixels[i][c],
            variance: image.correlation * image.pixels[i][c].variance_of_mean(),
            of_reference: image.correlation * of_one(i, c) / arguments.reference_spp,
            of_as_many: image.correlation * of_one(i, c) / f64::from(spp * PARTS),
        };
        judge(size, &sample, &rounding)
    };
    let with_again = |again: &Image| {
        let sample = |i: usize, c: usize| Sample {
            difference: ours.pixels[i][c].mean() - again.pixels[i][c].mean(),
            expected: again.pixels[i][c].mean(),
            variance: ours.correlation * ours.pixels[i][c].variance_of_mean(),
            of_reference: again.correlation * again.pixels[i][c].variance_of_mean(),
            of_as_many: ours.correlation * of_one(i, c) / f64::from(spp * PARTS),
        };
        judge(size, &sample, &|_, _| 0.0)
    };
    let again = again.map(|again| [with_reference(&again), with_again(&again)]);
    Ok((with_reference(&ours), again))
}

/// An image of several runs.
struct Image {
    pixels: Vec<[Moments; 3]>,
    /// Variance of block means over what it would be if pixels were independent: under filters that reach neighbours, they have
    /// samples in common. In the mean of the image.
    correlation: f64,
}

/// Of each pixel over images of other seeds, which all have the same size.
fn moments(size: [u32; 2], image: impl Fn(u32) -> Result<Plain, String>) -> Result<Image, String> {
    let mut sums = vec![[Moments::default(); 3]; size[0] as usize * size[1] as usize];
    let mut blocks = BTreeMap::<[u32; 2], [Moments; 3]>::new();
    for seed in 0..PARTS {
        let part = image(seed)?;
        if part.size != size {
            return Err(format!("the image is {:?}, the reference {size:?}", part.size));
        }
        for (sum, pixel) in sums.iter_mut().zip(&part.pixels) {
            for (sum, value) in sum.iter_mut().zip(pixel) {
                sum.push(*value);
            }
        }
        let mut totals = BTreeMap::<[u32; 2], [f64; 3]>::new();
        for (i, pixel) in (0..).zip(&part.pixels) {
            let total = totals.entry([i % size[0] / BLOCK, i / size[0] / BLOCK]).or_default();
            for (total, value) in total.iter_mut().zip(pixel) {
                *total += value;
            }
        }
        for (at, total) in totals {
            let block = blocks.entry(at).or_default();
            for (block, value) in block.iter_mut().zip(total) {
                block.push(value);
            }
        }
    }
    let variance = |m: &Moments| m.variance_of_mean();
    let apart: f64 = sums.iter().flatten().map(variance).sum();
    let together: f64 = blocks.values().flatten().map(variance).sum();
    let correlation = if apart > 0.0 { together / apart } else { 1.0 };
    Ok(Image { pixels: sums, correlation })
}

fn file_name(scene: &Scene, seed: u32) -> String {
    format!("{}.{seed}.exr", scene.name.replace('/', "_"))
}

/// The plain layer of a file, in XYZ.
struct Plain {
    size: [u32; 2],
    pixels: Vec<[f64; 3]>,
}

fn plain(file: &ExrFile) -> Result<Plain, String> {
    let layer = file.layers.get("").ok_or("no plain layer")?;
    Ok(Plain { size: file.size, pixels: layer.iter().map(|p| xyz(*p)).collect() })
}

/// How precise the numbers of a reference are.
struct Precision {
    /// Samples that were added up.
    samples: f64,
    /// The means were kept in half precision.
    half: bool,
}

/// The error that the numbers of a pixel have by their precision: a variance.
enum Rounding {
    /// Another one in every pixel.
    Random(f64),
    /// The same in pixels that are equal.
    Systematic(f64),
}

/// From linear sRGB to XYZ.
const TO_XYZ: [[f64; 3]; 3] = [
    [0.412453, 0.357580, 0.180423],
    [0.212671, 0.715160, 0.072169],
    [0.019334, 0.119193, 0.950227],
];

fn xyz(pixel: [f32; 3]) -> [f64; 3] {
    TO_XYZ.map(|row| (0..3).map(|c| row[c] * f64::from(pixel[c])).sum())
}

/// The distance of neighbouring half-precision numbers about a number.
fn half_step(x: f64) -> f64 {
    let exponent = x.abs().max(f64::MIN_POSITIVE).log2().floor().max(-14.0);
    2_f64.powf(exponent - 10.0)
}

impl Precision {
    fn of(pixels: &[[f64; 3]], samples: f64) -> Self {
        // The matrix is known to six digits.
        let is_half = |x: f64| {
            let step = half_step(x);
            (x / step - (x / step).round()).abs() * step <= 2e-6 * x.abs() + 1e-9
        };
        let values = || pixels.iter().flatten();
        let half = values().filter(|x| is_half(**x)).count();
        // By chance about one in a hundred would be.
        Self { samples, half: half * 10 >= values().count() * 9 }
    }

    /// The largest error of a sum of equal samples, over the sum.
    fn of_equal(&self) -> f64 {
        self.samples * f64::from(f32::EPSILON) / 4.0
    }

    /// Of a pixel with this mean and variance of one sample.
    fn of_pixel(&self, mean: f64, variance: f64) -> Rounding {
        let stored = if self.half { half_step(mean).powi(2) / 12.0 } else { 0.0 };
        if variance > self.of_equal() * mean * mean {
            let step = mean.abs() * f64::from(f32::EPSILON);
            Rounding::Random(step * step * self.samples / 12.0 + stored)
        } else {
            Rounding::Systematic((self.of_equal() * mean).powi(2) / 3.0 + stored)
        }
    }

    /// Means that may be equal but for their precision.
    fn class(&self, mean: f64) -> i64 {
        (mean.abs().max(f64::MIN_POSITIVE).ln() / (2.0 * self.of_equal())).round() as i64
    }
}

#[derive(Default)]
struct Sample {
    difference: f64,
    expected: f64,
    variance: f64,
    of_reference: f64,
    /// What the reference's variance would be with as many samples as the image has.
    of_as_many: f64,
}

/// From this relative standard error on, a block's own variance is no good estimate of itself: few
/// samples make up its mean. That of the reference is taken there if it is larger.
const NOISY: f64 = 0.1;

/// Compares images of a `size` by their samples; `rounding` gives the variance of the sum of some pixels by the reference's precision.
fn judge(
    size: [u32; 2],
    sample: &dyn Fn(usize, usize) -> Sample,
    rounding: &dyn Fn(&[usize], usize) -> f64,
) -> Comparison {
    let [width, height] = size;
    let blocks: Vec<[u32; 2]> = (0..height.div_ceil(BLOCK))
        .flat_map(|y| (0..width.div_ceil(BLOCK)).map(move |x| [x * BLOCK, y * BLOCK]))
        .collect();
    let (mut squares, mut max_z, mut difference, mut expected) = (0.0, 0.0_f64, 0.0, 0.0);
    let mut rounded = 0.0;
    for [x0, y0] in &blocks {
        for c in 0..3 {
            let mut sum = Sample::default();
            let mut pixels = Vec::new();
            for y in *y0..(y0 + BLOCK).min(height) {
                for x in *x0..(x0 + BLOCK).min(width) {
                    let i = (y * width + x) as usize;
                    let s = sample(i, c);
                    pixels.push(i);
                    sum.difference += s.difference;
                    sum.expected += s.expected;
                    sum.variance += s.variance;
                    sum.of_reference += s.of_reference;
                    sum.of_as_many += s.of_as_many;
                }
            }
            difference += sum.difference;
            expected += sum.expected;
            // Both images are stored in single precision.
            let rounding = (1e-6 * sum.expected).powi(2) + rounding(&pixels, c);
            rounded += rounding;
            let noisy = sum.variance.max(sum.of_as_many).sqrt() > NOISY * sum.expected;
            let own = if noisy { sum.variance.max(sum.of_as_many) } else { sum.variance };
            let z = match own + sum.of_reference + rounding {
                0.0 if sum.difference == 0.0 => 0.0,
                variance => sum.difference.abs() / variance.sqrt(),
            };
            squares += z * z;
            max_z = max_z.max(z);
        }
    }
    let numbers = (3 * blocks.len()).max(1) as f64;
    let rms_z = (squares / numbers).sqrt();
    // Of 108 numbers, the size of most references, chance passes 4.9 once in ten thousand images.
    Comparison {
        rms_z,
        max_z,
        bias: difference / expected,
        rounding: (rounded * numbers).sqrt() / expected,
        agrees: rms_z <= 1.3 && max_z < 5.0,
    }
}

fn render(scene: &Scene, spp: u32, seed: u32, arguments: &Arguments) -> Result<ExrFile, String> {
    let temporary = std::env::temp_dir().join(format!("drt-scene-table-{}", std::process::id()));
    let folder = arguments.keep.as_ref().unwrap_or(&temporary);
    std::fs::create_dir_all(folder).map_err(|e| e.to_string())?;
    let output = folder.join(file_name(scene, seed));
    let beside = std::env::current_exe().ok().and_then(|e| Some(e.parent()?.parent()?.join("drt")));
    let program = arguments.drt.clone().or(beside).unwrap_or_else(|| "drt".into());
    let run = Command::new(&program)
        .arg("render")
        .arg(&scene.path)
        .args(["--quiet", "--spp", &spp.to_string(), "--seed", &seed.to_string(), "-o"])
        .arg(&output)
        .output()
        .map_err(|e| format!("cannot run {}: {e}", program.display()))?;
    let image = if run.status.success() {
        read_exr(&output).map_err(|e| e.to_string())
    } else {
        let message = String::from_utf8_lossy(&run.stderr);
        Err(message.lines().next().unwrap_or("failed without a message").to_owned())
    };
    if arguments.keep.is_none() {
        drop(std::fs::remove_dir_all(&temporary));
    }
    image
}
