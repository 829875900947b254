//! The gradient of a loss, from the loss's derivative with respect to every pixel.

use drt_estimators::fit::{Collector, Group};
use drt_estimators::{Derivative, GradientBatch, Layer, Rendering, Scene, SceneGradient};
use drt_math::Rgb;
use drt_motion::Parameter;

use crate::{CliError, Job};

/// Between the seeds of an image and of the gradient by what it says.
const INDEPENDENT: u64 = 0xa076_1d64_78bd_642f;

/// The seed of the gradient of a loss whose derivative comes from an image of this seed: with the same one, the errors of both
/// would be correlated, and the gradient biased.
#[must_use]
pub fn independent_seed(seed: u64) -> u64 {
    seed.wrapping_add(INDEPENDENT)
}

/// The gradient with respect to the parameters that a rendering has derivatives of.
pub(crate) fn by_parameters(rendering: &Rendering, adjoint: &[Rgb]) -> Vec<f64> {
    let product = |d: &Derivative| -> f64 {
        d.total.pixels.iter().zip(adjoint).map(|(p, a)| p.mean.dot(*a)).sum()
    };
    rendering.derivatives.iter().map(product).collect()
}

/// Derivatives with the names of what they are with respect to.
pub(crate) fn named(parameters: &[Parameter<String>], layers: Vec<Layer>) -> Vec<Derivative> {
    let pairs = parameters.iter().zip(layers);
    pairs.map(|(p, total)| Derivative { name: p.name.clone(), total, terms: Vec::new() }).collect()
}

/// Refuses an adjoint of another size than an image.
pub(super) fn check_size(rendering: &Rendering, adjoint: &[Rgb]) -> Result<(), CliError> {
    let (found, expected) = (adjoint.len(), rendering.image.pixels.len());
    if found == expected {
        return Ok(());
    }
    Err(CliError::argument(format!("the adjoint has {found} pixels; expected {expected}")))
}

/// What extracts the parts of some of a job's groups from gradients of a scene at all values.
pub(crate) fn collectors<'g>(
    job: &Job,
    groups: impl Iterator<Item = &'g Group>,
    scene: &Scene,
) -> Result<Vec<Collector>, CliError> {
    let collector = |group: &Group| group.collector(&job.scene, scene, &job.parameters);
    groups.map(collector).collect::<Result<_, _>>().map_err(|e| job.blame(&e))
}

/// Adds the groups' parts of a gradient to the numbers of each of them.
pub(crate) fn collect<'n>(
    collectors: &[Collector],
    gradient: &SceneGradient,
    numbers: impl Iterator<Item = &'n mut [f64]>,
) {
    collectors
        .iter()
        .zip(numbers)
        .for_each(|(collector, own)| collector.add_to(gradient, 1.0, own));
}

/// The sums over batches of a gradient with respect to groups.
pub(super) struct GroupGradient {
    /// Those of paths, and those of boundary samples.
    sums: [Vec<Vec<f64>>; 2],
}

impl GroupGradient {
    pub(super) fn new<'g>(groups: impl Iterator<Item = &'g Group>, given: &Scene) -> Self {
        let zeros: Vec<Vec<f64>> = groups.map(|group| vec![0.0; group.count(given)]).collect();
        Self { sums: [zeros.clone(), zeros] }
    }

    pub(super) fn add(&mut self, collectors: &[Collector], batch: &GradientBatch) {
        for (sum, part) in self.sums.iter_mut().zip([&batch.pixels, &batch.boundary]) {
            collect(collectors, part, sum.iter_mut().map(Vec::as_mut_slice));
        }
    }

    /// The gradient with respect to each group.
    pub(super) fn finish(self) -> Vec<Vec<f64>> {
        let [mut pixels, boundary] = self.sums;
        for (sum, part) in pixels.iter_mut().flatten().zip(boundary.iter().flatten()) {
            *sum += part;
        }
        pixels
    }
}
