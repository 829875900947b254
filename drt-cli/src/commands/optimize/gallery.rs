//! Pictures of a run: targets, the images on the way there, and derivatives.

use std::path::{Path, PathBuf};

use drt_estimators::fit::Evaluation;
use drt_geom::Mesh;
use drt_math::{Rgb, Vec3};

use super::problem::Problem;
use super::turntable::turning;
use crate::CliError;
use crate::files::atomic::write_atomically;
use crate::files::image::picture::{SCREEN, encode_png};
use crate::files::image::tone::{Pixel, diverging, exposed, white_of};

/// Images on the way, the first and last included.
const FRAMES: u32 = 9;

/// The pictures in a checkpoint folder.
pub(super) struct Gallery<'a> {
    problem: &'a Problem<'a>,
    folder: &'a Path,
    /// Per view: what is shown as white.
    white: Vec<f64>,
}

impl<'a> Gallery<'a> {
    pub(super) fn new(problem: &'a Problem<'a>, folder: &'a Path) -> Self {
        let white = problem.views.iter().map(|v| white_of(v.reference.pixels())).collect();
        Self { problem, folder, white }
    }

    /// Iterations whose images are kept.
    pub(super) fn frames(&self) -> impl Iterator<Item = u32> {
        let n = self.problem.iterations;
        let stride = n.div_ceil(FRAMES - 1).max(1);
        (0..n).step_by(stride as usize).chain(std::iter::once(n))
    }

    /// The file of a view's picture; a view counts only where there are several.
    pub(super) fn file(&self, view: usize, name: &str) -> PathBuf {
        let several = self.problem.views.len() > 1;
        let name = if several { format!("{name}-{}", view + 1) } else { name.to_owned() };
        self.folder.join(name + ".png")
    }

    pub(super) fn frame(&self, view: usize, iteration: u32) -> PathBuf {
        self.file(view, &format!("frame-{iteration:05}"))
    }

    pub(super) fn derivative(&self, view: usize, parameter: usize) -> PathBuf {
        self.file(view, &format!("derivative-{parameter:03}"))
    }

    /// The shape that a group moves.
    pub(super) fn shape(&self, group: &str) -> PathBuf {
        self.folder.join(format!("{group}-turning.png"))
    }

    /// True for the files that a run writes, or removes when it begins anew.
    pub(super) fn writes(&self, path: &Path) -> bool {
        let views = 0..self.problem.views.len();
        let own = |v: usize| {
            let named = ["target", "initial", "current", "difference"];
            let parameters = 0..self.problem.job.parameters.len();
            named.into_iter().any(|name| self.file(v, name) == path)
                || parameters.into_iter().any(|p| self.derivative(v, p) == path)
        };
        let name = path.file_name().unwrap_or_default();
        let mut groups = self.problem.job.groups.iter();
        is_frame(&name.to_string_lossy())
            || views.into_iter().any(own)
            || groups.any(|group| self.shape(&group.group.name) == path)
    }

    /// Removes what a run that began anew left of another: images of iterations that this one may not keep.
    pub(super) fn clear(&self) {
        let Ok(entries) = std::fs::read_dir(self.folder) else { return };
        for entry in entries.flatten() {
            if is_frame(&entry.file_name().to_string_lossy()) {
                // One that stays does no harm.
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Stores the targets.
    pub(super) fn targets(&self) -> Result<(), CliError> {
        for (v, view) in self.problem.views.iter().enumerate() {
            let pixels = exposed(view.reference.pixels(), self.white[v]);
            write(&self.file(v, "target"), view.reference.size(), &pixels)?;
        }
        Ok(())
    }

    /// Stores what an iteration saw as the frame of its number, where that is kept.
    pub(super) fn keep(&self, iteration: u32, evaluation: &Evaluation) -> Result<(), CliError> {
        if !self.frames().any(|i| i == iteration) {
            return Ok(());
        }
        self.image(iteration, evaluation, |v| self.frame(v, iteration))?;
        if iteration == 0 {
            self.image(iteration, evaluation, |v| self.file(v, "initial"))?;
        }
        Ok(())
    }

    /// Stores what an iteration saw as the present state.
    pub(super) fn current(&self, iteration: u32, evaluation: &Evaluation) -> Result<(), CliError> {
        self.image(iteration, evaluation, |v| self.file(v, "current"))?;
        for v in (0..self.problem.views.len()).filter(|v| evaluation.sees(*v)) {
            let (size, image) = (self.problem.size(v, iteration), evaluation.image(v));
            for p in 0..self.problem.job.parameters.len() {
                let derivative = diverging(&evaluation.derivative(v, p));
                write(&self.derivative(v, p), size, &derivative)?;
            }
            let reference = &self.problem.views[v].reference;
            if size == reference.size() {
                let pairs = image.iter().zip(reference.pixels());
                let difference: Vec<Rgb> = pairs.map(|(a, b)| *a - *b).collect();
                write(&self.file(v, "difference"), size, &diverging(&difference))?;
            }
        }
        Ok(())
    }

    /// Stores the shape that a group moves, as it was and as it is now, seen from all around.
    pub(super) fn turning(&self, group: &str, [before, now]: [&Mesh; 2]) -> Result<(), CliError> {
        let sensor = self.problem.views.first().map(|view| view.sensor);
        let sensors = &self.problem.job.scene.sensors;
        let up = sensor.map_or(Vec3::Y, |s| sensors[s].item.sensor.pinhole().up);
        let Some((size, pixels)) = turning(&[before, now], up) else { return Ok(()) };
        write(&self.shape(group), size, &exposed(&pixels, 1.0))
    }

    fn image(
        &self,
        iteration: u32,
        evaluation: &Evaluation,
        file: impl Fn(usize) -> PathBuf,
    ) -> Result<(), CliError> {
        for v in (0..self.problem.views.len()).filter(|v| evaluation.sees(*v)) {
            let pixels = exposed(&evaluation.image(v), self.white[v]);
            write(&file(v), self.problem.size(v, iteration), &pixels)?;
        }
        Ok(())
    }
}

/// True for the names that [`Gallery::frame`] gives.
fn is_frame(name: &str) -> bool {
    let numbers = name.strip_prefix("frame-").and_then(|rest| rest.strip_suffix(".png"));
    numbers.is_some_and(|n| {
        n.split('-').all(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    })
}

fn write(path: &Path, size: [u32; 2], pixels: &[Pixel]) -> Result<(), CliError> {
    write_atomically(path, |out| Ok(encode_png(out, size, pixels, Some(SCREEN))?))
}
