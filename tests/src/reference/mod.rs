//! Derivative images of long runs, stored in the repository: what shorter runs are judged by.
//!
//! Each carries a [fingerprint](fingerprint()) of the scene and the parameter that it stands for. One whose scene has changed since
//! is refused.

mod file;
mod fingerprint;

use drt_estimators::{Agreement, Estimate, Layer, Scene, Settings, Tail, Unattended, agreement};
use drt_math::Rgb;
use drt_motion::Parameter;

use crate::Result;

pub use file::{Wanted, stored, write};
pub use fingerprint::fingerprint;

/// Seed of the first references that were stored. Each that takes the place of another has the next one.
pub const SEED: u64 = 11;

/// Errors below this part of an image's rms are not told apart.
pub const RESOLUTION: f64 = 5e-3;

/// A derivative image, as means over blocks of pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// What it is the derivative by.
    pub name: String,
    /// Stands for the scene and the parameter.
    pub fingerprint: u64,
    /// Samples per pixel of each image.
    pub samples: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The step of the finite difference, or 0 where it is none.
    pub step: f64,
    /// The derivative.
    pub blocks: Vec<Estimate>,
    /// What doubling the step adds.
    pub change: Vec<Rgb>,
}

impl Reference {
    /// The finite difference by half of a step, with what the whole step changes.
    ///
    /// # Errors
    /// When the library rejects the scene or the parameter.
    pub fn by_differences(
        scene: &Scene,
        parameter: &Parameter,
        step: f64,
        samples: u32,
        seed: u64,
    ) -> Result<Self> {
        // Tests run side by side; each keeps to one thread.
        let settings = Settings { threads: 1, seed, ..Settings::default() };
        let parameters = std::slice::from_ref(parameter);
        let difference = |step: f64| -> Result<Vec<Estimate>> {
            let layers = drt_estimators::finite_differences(
                scene,
                parameters,
                &settings,
                samples,
                step,
                &Unattended,
            )?;
            Ok(layers.into_iter().next().ok_or("no finite difference")?.blocks)
        };
        let (whole, blocks) = (difference(step)?, difference(0.5 * step)?);
        let change = whole.iter().zip(&blocks).map(|(w, h)| w.mean - h.mean).collect();
        let (name, step) = (parameter.name.clone(), 0.5 * step);
        Ok(Self { name, fingerprint: 0, samples, seed, step, blocks, change })
    }

    /// Lets these derivatives stand for the scene that has this fingerprint.
    #[must_use]
    pub fn standing_for(self, fingerprint: u64) -> Self {
        Self { fingerprint, ..self }
    }

    /// The derivative as a layer that has blocks only.
    #[must_use]
    pub fn layer(&self) -> Layer {
        layer(self.blocks.clone())
    }

    /// What doubling the step adds, as a layer that has blocks only.
    #[must_use]
    pub fn change(&self) -> Layer {
        layer(self.change.iter().map(|c| Estimate { mean: *c, stderr: Rgb::ZERO }).collect())
    }

    /// Compares two references that stand for the same, of different random numbers.
    #[must_use]
    pub fn agreement(&self, other: &Self) -> Agreement {
        let other = other.layer();
        let least = RESOLUTION * other.rms_value();
        agreement(&self.layer(), &at_least(other, least), None)
    }
}

/// The layer with no error of a block below `least`.
#[must_use]
pub fn at_least(mut layer: Layer, least: f64) -> Layer {
    for block in &mut layer.blocks {
        block.stderr = block.stderr.map(|e| e.max(least));
    }
    layer
}

fn layer(blocks: Vec<Estimate>) -> Layer {
    let total = Estimate { mean: Rgb::ZERO, stderr: Rgb::ZERO };
    Layer { size: [0; 2], pixels: Vec::new(), blocks, total, tail: Tail::default() }
}
