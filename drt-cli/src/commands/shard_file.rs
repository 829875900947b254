//! What a shard leaves to be merged: sums to the last bit, inside an ordinary file.
//!
//! Images are OpenEXR with the shard's own image to look at, and the sums in an attribute. Gradients are NPY,
//! an array of bytes. The bytes are those of [postcard](https://postcard.jamesmunns.com), whose layout only
//! the same version of the program is sure to know: so its name comes first.

use std::path::Path;

use drt_estimators::fit::View;
use drt_estimators::loss::{Loss, Reference};
use drt_estimators::{Shard, ShardSums};
use drt_math::Rgb;
use serde::{Deserialize, Serialize};

use super::fingerprint::Fingerprint;
use crate::error::Place;
use crate::files::image::attachment;
use crate::files::npy::{is_npy, npy_bytes};
use crate::files::{checksum, input_file};
use crate::{CliError, PROGRAM};

/// Everything that a shard knows.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct ShardFile {
    /// The version of the program; first, so that others can read it.
    program: String,
    pub(crate) shard: Shard,
    /// Of the job and all options that decide its result.
    pub(crate) inputs: Fingerprint,
    pub(crate) seed: u64,
    pub(crate) command: String,
    pub(crate) scene: String,
    /// The job file and its text, where there was one.
    pub(crate) job: Option<(String, String)>,
    pub(crate) seconds: f64,
    pub(crate) cpu_seconds: f64,
    pub(crate) threads: usize,
    pub(crate) sums: Sums,
}

/// What was added up.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) enum Sums {
    /// Of images and derivatives.
    Images(ShardSums),
    /// Of images by two independent halves of the samples, and the loss that they go into.
    Halves { halves: Box<[ShardSums; 2]>, loss: Loss, target: Reference },
    /// Of the gradient of a loss that is known by its derivative by every pixel.
    Gradient {
        adjoint: Vec<Rgb>,
        /// By the parameters, where there are any.
        images: Option<ShardSums>,
        /// By the parameter groups.
        batches: Vec<Batch>,
    },
}

/// What one batch of samples adds to a gradient by parameter groups.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(crate) struct Batch {
    pub(crate) number: u32,
    /// By the paths of pixels; and the samples of each pixel, and of all batches.
    pub(crate) pixels: Vec<f64>,
    pub(crate) of_pixels: [u32; 2],
    /// By boundary samples; and their batches, and those of all.
    pub(crate) boundary: Vec<f64>,
    pub(crate) of_boundary: [u32; 2],
}

/// Batches added up, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Total(Option<Batch>);

impl Total {
    /// The sums over paths and over boundary samples, to which the next batch of a gradient by so many unknowns is to be
    /// added; `None` for a batch that is not of this gradient.
    pub(crate) fn next(
        &mut self,
        unknowns: usize,
        of_pixels: [u32; 2],
        of_boundary: [u32; 2],
    ) -> Option<[&mut [f64]; 2]> {
        let sum = self.0.get_or_insert_with(|| Batch {
            number: 0,
            pixels: vec![0.0; unknowns],
            of_pixels: [0, of_pixels[1]],
            boundary: vec![0.0; unknowns],
            of_boundary: [0, of_boundary[1]],
        });
        let fits = sum.pixels.len() == unknowns
            && sum.of_pixels[1] == of_pixels[1]
            && sum.of_boundary[1] == of_boundary[1];
        sum.of_pixels[0] += of_pixels[0];
        sum.of_boundary[0] += of_boundary[0];
        fits.then_some([&mut sum.pixels, &mut sum.boundary])
    }

    /// Adds the next batch; false for one that is not of this gradient.
    pub(crate) fn add(&mut self, batch: &Batch) -> bool {
        let Batch { pixels, of_pixels, boundary, of_boundary, .. } = batch;
        let sums = self.next(pixels.len(), *of_pixels, *of_boundary);
        let Some(sums) = sums.filter(|_| boundary.len() == pixels.len()) else { return false };
        for (sum, part) in sums.into_iter().zip([pixels, boundary]) {
            sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        true
    }

    /// The gradient; what is missing counts as what is there.
    pub(crate) fn numbers(self) -> Vec<f64> {
        let Batch { mut pixels, of_pixels, boundary, of_boundary, .. } = self.0.unwrap_or_default();
        // Exactly 1 where nothing is missing.
        let scale = |[there, all]: [u32; 2]| f64::from(all) / f64::from(there);
        let (a, b) = (scale(of_pixels), scale(of_boundary));
        pixels.iter_mut().zip(&boundary).for_each(|(p, s)| *p = *p * a + s * b);
        pixels
    }
}

impl ShardFile {
    /// Of this version of the program.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn new(
        job: &crate::Job,
        shard: Shard,
        inputs: Fingerprint,
        command: &str,
        sums: Sums,
    ) -> Self {
        Self {
            program: PROGRAM.into(),
            shard,
            inputs,
            seed: job.settings.seed,
            command: command.into(),
            scene: job.scene_path.display().to_string(),
            job: job.text.clone().map(|text| (job.path.display().to_string(), text)),
            seconds: 0.0,
            cpu_seconds: 0.0,
            threads: 0,
            sums,
        }
    }

    /// What to put into a file, with a place for its [`checksum`].
    pub(crate) fn bytes(&self) -> Result<Vec<u8>, CliError> {
        postcard::to_extend(self, checksum::space().to_vec())
            .map_err(|e| CliError::argument(format!("a shard: {e}")))
    }

    /// Reads what a shard has left in an EXR or NPY file.
    pub(crate) fn read(path: &Path) -> Result<Self, CliError> {
        Self::parse(path, input_file::read_at(path, None)?)
    }

    fn parse(path: &Path, file: Vec<u8>) -> Result<Self, CliError> {
        let fail = |message: String| CliError::input(&Place::file(path), message);
        let expected = "expected a file that `drt render` or `drt grad` wrote with --shard";
        match checksum::is_whole(&file) {
            None => return Err(fail(format!("it is not a shard; {expected}"))),
            Some(false) => return Err(fail("it is damaged: its checksum does not fit".into())),
            Some(true) => {}
        }
        let bytes = match is_npy(&file) {
            true => npy_bytes(file),
            false => attachment(path, &file)?,
        };
        let bytes = bytes.as_deref().and_then(checksum::content);
        let bytes = bytes.ok_or_else(|| fail(format!("it is not a shard; {expected}")))?;
        let (program, _) = postcard::take_from_bytes::<String>(bytes)
            .map_err(|e| fail(format!("it is not a shard: {e}; {expected}")))?;
        if program != PROGRAM {
            return Err(fail(format!(
                "it was written by {program}, and this is {PROGRAM}; shards are merged by the \
                 version that made them"
            )));
        }
        postcard::from_bytes(bytes).map_err(|e| fail(format!("it is damaged: {e}")))
    }
}

/// The only view of a gradient of a loss.
pub(crate) fn view(target: Reference) -> View {
    View::new(0, target)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Folder, damaged};

    const SCENE: &str = r#"<scene version="3.0.0"><sensor type="perspective">
  <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
  <emitter type="constant" id="sky"/></scene>"#;
    const JOB: &str = "scene = \"s.xml\"\n[[parameter]]\nname = \"p\"\n[[parameter.effect]]\n\
                       target = \"sky\"\nproperty = \"radiance\"\nmultiply = 1.0\n";

    #[test]
    fn every_damaged_shard_is_refused() {
        let folder = Folder::new();
        folder.file("s.xml", SCENE);
        let job = folder.file("j.toml", JOB);
        let target = folder.path().join("t.exr");
        let run = |line: &[&str]| crate::commands::main(line.iter().map(Into::into));
        let text = |path: &Path| path.to_string_lossy().into_owned();
        let (job, target) = (text(&job), text(&target));
        assert_eq!(run(&["drt", "render", &job, "--spp", "4", "--quiet", "-o", &target]), 0);
        for (name, more) in [("1.exr", None), ("1.npy", Some(["--loss", &target]))] {
            let path = folder.path().join(name);
            let output = text(&path);
            let line =
                ["drt", "grad", &job, "--shard", "1/2", "--quiet", "--spp", "4", "-o", &output];
            let line: Vec<&str> = line.into_iter().chain(more.into_iter().flatten()).collect();
            assert_eq!(run(&line), 0);
            let file = std::fs::read(&path).unwrap();
            assert!(ShardFile::parse(&path, file.clone()).is_ok());
            for copy in damaged(&file, 1000) {
                assert!(ShardFile::parse(&path, copy).is_err());
            }
            // Another version of the program, of a name as long.
            let mut other = file;
            let seal = &checksum::space()[..16];
            let at = other.windows(seal.len()).position(|w| w == seal).unwrap();
            let end = at + checksum::space().len() + 1 + PROGRAM.len();
            assert!(other[..end].ends_with(PROGRAM.as_bytes()));
            other[end - 1] ^= 1;
            checksum::seal(&mut other);
            let error = ShardFile::parse(&path, other).unwrap_err().to_string();
            assert!(error.contains("it was written by drt"), "{error}");
        }
    }
}
