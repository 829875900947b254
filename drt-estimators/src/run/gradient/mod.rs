//! Reverse mode: the gradient of a loss with respect to all quantities of a scene, from paths, records and boundary
//! samples like those of derivative images.
//!
//! With the adjoint a_i = ∂Loss/∂I_i at pixel i, the gradient with respect to a quantity q is Σ_i a_i ∂I_i/∂q. Forward
//! mode takes the dot product of sensitivities (to positions, normals, coefficients) and the tangents of its
//! parameters. Reverse mode multiplies each sensitivity by its pixel's adjoint, and adds it up at the quantities that
//! it depends on: at mesh vertices, through the transposed jets of surface points; for points inside a medium, at the
//! vertices of its tetrahedra, and from there at the vertices of the shapes around it; at voxels, through the
//! transposed interpolation. The cost does not grow with the number of quantities. With equal seeds and without
//! [`guiding`](crate::Settings::guiding), ⟨a, J v⟩ = ⟨Jᵀ a, v⟩ to rounding.

mod everything;
mod pieces;
mod sink;
mod sizes;

use alloc::vec::Vec;

use drt_math::Rgb;

use crate::derivative::scene_gradient::SceneGradient;
use crate::estimators::Estimator;
use crate::estimators::emitter_shares::shares;
use crate::model::error::{Error, SettingError};
use crate::model::rendering::Account;
use crate::model::scene::Target;
use crate::model::settings::{PathSampling, Settings};
use crate::model::shard::Shard;
use crate::run::component::{Component, Unknowns, seed_of_component};
use crate::run::control::Control;
use crate::run::gradient::everything::Everything;
pub(crate) use crate::run::gradient::everything::active;
use crate::run::gradient::pieces::{Pieces, Work};
#[cfg(all(test, feature = "std"))]
pub(crate) use crate::run::gradient::sink::ScatterSink;
use crate::run::gradient::sink::Sums;
use crate::run::gradient::sizes::OfGradient;
use crate::sampling::bidirectional::EmissionSampler;
use crate::sampling::film::BATCHES;
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::Pass;
use crate::world::World;

/// What one batch of samples adds to a [gradient](crate::Session::gradient).
#[derive(Clone, Debug)]
pub struct GradientBatch {
    /// Number of the batch, from 0. To get the gradient, add up the `pixels` of all batches in this order, and their
    /// `boundary` likewise, and then add the two sums.
    pub number: u32,
    /// The gradient from the paths of pixels.
    pub pixels: SceneGradient,
    /// Samples of each pixel in this batch, and in all batches together.
    pub of_pixels: [u32; 2],
    /// The gradient from boundary samples.
    pub boundary: SceneGradient,
    /// Parts of the boundary samples in this batch, and in all batches together.
    pub of_boundary: [u32; 2],
}

/// A world prepared for gradients by some items.
pub(crate) struct PreparedGradient {
    /// Lit by all emitters, with what the gradient needs of paths.
    paths: World,
    wanted: Vec<Target>,
    components: Vec<Component<Everything>>,
    /// Where paths of light start, if there are any.
    emission: Option<EmissionSampler>,
    /// Image points come in mirrored pairs.
    antithetic: bool,
}

/// Samples of a gradient.
pub(crate) struct Sampling<'a> {
    pub(crate) pool: &'a Pool,
    pub(crate) seed: u64,
    /// Samples per pixel.
    pub(crate) spp: u32,
    /// The loss's derivative by each pixel.
    pub(crate) adjoint: &'a [Rgb],
    /// The part of the samples that is taken; all where it is not said.
    pub(crate) shard: Option<Shard>,
    pub(crate) control: &'a dyn Control,
}

impl PreparedGradient {
    /// Prepares a world that is lit by all emitters.
    pub(crate) fn new(
        estimator: &'static dyn Estimator,
        world: &World,
        wanted: &[Target],
        settings: &Settings,
    ) -> Result<Self, Error> {
        let mut components = Vec::new();
        for share in shares(estimator, &world.scene, wanted.iter().copied(), settings) {
            let world = world.lit_by(share.lit)?;
            let asked = &share.settings.insides;
            let everything = Everything::new(&world, wanted, share.estimator, asked)?;
            components.push(Component::new(world, everything, &share)?);
        }
        let mut paths = world.clone();
        let needs = components.iter().map(|component| component.unknowns.needs());
        if let Some(needs) = needs.reduce(|all, needs| all.union(&needs)) {
            paths.prepare_for_derivatives(needs);
        }
        let bidirectional = settings.sampling == PathSampling::Bidirectional;
        Ok(Self {
            emission: bidirectional.then(|| EmissionSampler::new(&paths)),
            antithetic: components.iter().any(|c| c.prepared.terms.antithetic),
            wanted: wanted.to_vec(),
            paths,
            components,
        })
    }

    /// A gradient without samples.
    pub(crate) fn zeros(&self) -> SceneGradient {
        SceneGradient::zeros(&self.paths, &active(&self.paths.scene, &self.wanted))
    }

    /// Calls `each` with every batch of samples, or with those of a shard, in order. False when cancelled.
    ///
    /// # Errors
    /// When the adjoint's size is not the film's, and when there are more shards than batches.
    pub(crate) fn run(
        &mut self,
        sampling: &Sampling<'_>,
        each: &mut dyn FnMut(GradientBatch),
    ) -> Result<bool, Error> {
        let Sampling { spp, adjoint, shard, control, .. } = *sampling;
        let film = self.paths.camera.film();
        if adjoint.len() != (film[0] * film[1]) as usize {
            let reason = SettingError::PixelCount { found: adjoint.len(), expected: film };
            return Err(Error::Setting { setting: "adjoint", reason });
        }
        let units = spp.div_ceil(if self.antithetic { 2 } else { 1 }).max(1);
        let pass = Pass::new(0, units, film);
        if let Some(shard) = shard.filter(|s| s.count() > pass.parts()) {
            let reason = SettingError::TooManyShards { count: shard.count(), most: pass.parts() };
            return Err(Error::Setting { setting: "shard", reason });
        }
        let Some(pilots) = self.learn(sampling) else { return Ok(false) };
        let pieces = Pieces { of: self, sampling, pass, cancelled: &|| control.cancelled() };
        let list = pieces.list(shard);
        let mut sums = [pieces.zeros(), pieces.zeros()];
        if let Some(first) = sums[1].first_mut() {
            first.scene.counters = pilots.counters;
            first.scene.non_finite += pilots.non_finite_count;
        }
        let work = |i: u32| pieces.take(&list[i as usize]);
        Ok(sampling.pool.ordered(0..list.len() as u32, 1, work, |i, parts| {
            if control.cancelled() {
                return false;
            }
            let piece = &list[i as usize];
            let [of_pixels, of_boundary] = &mut sums;
            let to = if matches!(piece.work, Work::Pixels(_)) { of_pixels } else { of_boundary };
            parts.into_iter().for_each(|(c, part)| to[c].add(part));
            if piece.last {
                let [pixels, boundary] =
                    core::mem::replace(&mut sums, [pieces.zeros(), pieces.zeros()])
                        .map(|sums| self.gather(sums));
                let number = piece.part.number;
                each(GradientBatch {
                    number,
                    pixels,
                    of_pixels: [piece.part.units[1] - piece.part.units[0], units],
                    boundary,
                    of_boundary: [pieces.batches(number).len() as u32, BATCHES as u32],
                });
            }
            true
        }))
    }

    /// Learns how to guide boundary samples for an adjoint; `None` when cancelled.
    fn learn(&mut self, sampling: &Sampling<'_>) -> Option<Account> {
        let Sampling { pool, seed, spp, adjoint, control, .. } = *sampling;
        let mut pilots = Account::default();
        let cancelled = || control.cancelled();
        for (c, component) in self.components.iter_mut().enumerate() {
            component.forget_pilots();
            let seed = seed_of_component(seed, c);
            let (account, going) = component.learn_levels(seed, spp, pool, &cancelled);
            pilots.add(account);
            if !going {
                return None;
            }
            for i in 0..component.sources().len() {
                let ratio = component.prepared.source_ratio(i);
                let samples = f64::from(spp) * ratio * adjoint.len() as f64;
                let (account, going) = component.learn(
                    i,
                    seed,
                    samples,
                    &self.paths,
                    pool,
                    |_, of| OfGradient::new(&of.active, adjoint),
                    &cancelled,
                );
                pilots.add(account);
                if !going {
                    return None;
                }
            }
        }
        Some(pilots)
    }

    /// What the components' sums are together.
    fn gather(&self, sums: Vec<Sums>) -> SceneGradient {
        let mut gradient = self.zeros();
        for (component, Sums { scene: mut sum, insides }) in self.components.iter().zip(sums) {
            let Component { prepared, unknowns, .. } = component;
            unknowns.insides.gather(&prepared.world, insides, &mut sum);
            gradient.add(sum);
        }
        gradient
    }
}
