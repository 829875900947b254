//! Files of references: one per scene, of lines of words.
//!
//! A line that begins with `#` is for readers. `derivative NAME` begins a reference, whose numbers follow by key. After `blocks` come
//! the blocks, row by row, each a line of nine integers: mean, standard error and change in red, green and blue, in the unit
//! that `unit` gives.

use std::fmt::Write as _;
use std::path::PathBuf;

use drt_estimators::Estimate;
use drt_math::Rgb;

use super::Reference;
use crate::Result;

/// How to make references anew.
const COMMAND: &str =
    "cargo test --release -p drt-tests --test all -- --ignored references --nocapture";

/// The unit of blocks, relative to the root mean square of the derivative.
const UNIT: f64 = 1e-5;

/// Blocks of an image.
const BLOCKS: usize = 64;

/// What is looked for in a file.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// What it is the derivative by.
    pub name: &'a str,
    /// Stands for the scene and the parameter.
    pub fingerprint: u64,
    /// Samples per pixel, where they are to be a certain number.
    pub samples: Option<u32>,
}

/// Those that are wanted of the references that are stored of a scene.
///
/// # Errors
/// When one is missing, cannot be read, or stands for something else than is wanted.
pub fn stored(scene: &str, wanted: &[Wanted<'_>]) -> Result<Vec<Reference>> {
    let path = path(scene);
    let fail = |what: &str| format!("{}: {what}; make it anew by `{COMMAND}`", path.display());
    let text = std::fs::read_to_string(&path).map_err(|e| fail(&e.to_string()))?;
    let all = parse(&text).map_err(|e| fail(&e.to_string()))?;
    let of = |wanted: &Wanted<'_>| -> Result<Reference> {
        let name = wanted.name;
        let found = all.iter().find(|r| r.name == name);
        let found = found.ok_or_else(|| fail(&format!("has no derivative by `{name}`")))?;
        if found.fingerprint != wanted.fingerprint {
            return Err(fail(&format!("the scene or the change of `{name}` is another now")).into());
        }
        if wanted.samples.is_some_and(|samples| samples != found.samples) {
            return Err(fail(&format!("`{name}` has other samples")).into());
        }
        Ok(found.clone())
    };
    wanted.iter().map(of).collect()
}

/// Stores the references of a scene in place of those before.
///
/// # Errors
/// When the file cannot be written.
pub fn write(scene: &str, references: &[Reference]) -> Result<()> {
    let text = text(scene, references)?;
    let path = path(scene);
    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()).into())
}

fn path(scene: &str) -> PathBuf {
    let name = scene.replace(|c: char| !c.is_ascii_alphanumeric(), "-").replace("--", "-");
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("references");
    folder.join(name).with_extension("txt")
}

fn text(scene: &str, references: &[Reference]) -> Result<String> {
    let mut text = String::new();
    writeln!(text, "# Derivatives of the scene `{scene}`, of long runs.")?;
    writeln!(text, "# Mean, standard error, and change by twice the step, of each block.")?;
    writeln!(text, "# Made by: {COMMAND}")?;
    for reference in references {
        let Reference { name, fingerprint, samples, seed, step, blocks, change } = reference;
        let unit = UNIT * reference.layer().rms_value();
        writeln!(text, "\nderivative {name}\nfingerprint {fingerprint:016x}")?;
        writeln!(text, "samples {samples}\nseed {seed}\nstep {step}")?;
        writeln!(text, "unit {unit:e}\nblocks")?;
        for (block, change) in blocks.iter().zip(change) {
            let line = [block.mean, block.stderr, *change]
                .map(|c| c.to_array().map(|n| format!("{}", (n / unit).round() as i64)).join(" "));
            writeln!(text, "{}", line.join("  "))?;
        }
    }
    Ok(text)
}

fn parse(text: &str) -> Result<Vec<Reference>> {
    let mut lines = text.lines().filter(|l| !l.is_empty() && !l.starts_with('#'));
    let mut all = Vec::new();
    while let Some(line) = lines.next() {
        let name = value(Some(line), "derivative")?.into();
        let fingerprint = u64::from_str_radix(value(lines.next(), "fingerprint")?, 16)?;
        let samples = value(lines.next(), "samples")?.parse()?;
        let seed = value(lines.next(), "seed")?.parse()?;
        let step = value(lines.next(), "step")?.parse()?;
        let unit = value(lines.next(), "unit")?.parse()?;
        if lines.next() != Some("blocks") {
            return Err("expected `blocks`".into());
        }
        let blocks: Vec<[Rgb; 3]> =
            lines.by_ref().take(BLOCKS).map(|line| block(line, unit)).collect::<Result<_>>()?;
        if blocks.len() < BLOCKS {
            return Err(format!("expected {BLOCKS} blocks").into());
        }
        let change = blocks.iter().map(|[.., change]| *change).collect();
        let blocks = blocks.iter().map(|[m, e, _]| Estimate { mean: *m, stderr: *e }).collect();
        all.push(Reference { name, fingerprint, samples, seed, step, blocks, change });
    }
    Ok(all)
}

fn value<'a>(line: Option<&'a str>, key: &str) -> Result<&'a str> {
    let found = line.and_then(|l| l.strip_prefix(key)?.strip_prefix(' '));
    Ok(found.ok_or_else(|| format!("expected `{key}`"))?)
}

fn block(line: &str, unit: f64) -> Result<[Rgb; 3]> {
    let numbers = line.split_whitespace().map(|w| Ok(w.parse::<i64>()? as f64 * unit));
    let numbers: Vec<f64> = numbers.collect::<Result<_>>()?;
    let [a, b, c, d, e, f, g, h, i] = numbers[..] else {
        return Err(format!("expected nine numbers in `{line}`").into());
    };
    // Numbers have been rounded to integers.
    let rounding = unit / f64::sqrt(12.0);
    let stderr = Rgb::new(d, e, f).map(|e| e.hypot(rounding));
    Ok([Rgb::new(a, b, c), stderr, Rgb::new(g, h, i)])
}
