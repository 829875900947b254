//! Where images and derivatives come from.

use alloc::vec::Vec;

use drt_math::Rgb;
use drt_motion::Parameter;

use crate::derivative::scene_gradient::SceneGradient;
use crate::derivative::tangents;
use crate::derivative::tangents::Tangents;
use crate::fit::evaluation::{Half, means};
use crate::model::error::{Error, SettingError};
use crate::model::scene::{Scene, Target};
use crate::model::settings::{EstimatorKind, Settings};
use crate::model::shard::Shard;
use crate::run::control::Control;
use crate::run::finite_difference::finite_differences;
use crate::run::session::choice::gradients;
use crate::run::session::{Session, ShardSums};
use crate::world::cache::PreparedCache;

/// A scene at its parameters' values, and its rates of change.
pub(super) struct Applied {
    pub(super) scene: Scene,
    tangents: Tangents,
}

impl Applied {
    pub(super) fn new(scene: &Scene, parameters: &[Parameter]) -> Result<Self, Error> {
        let (scene, tangents) = tangents::apply(scene, parameters)?;
        tangents.check()?;
        Ok(Self { scene, tangents })
    }

    /// With changes that are known beside those by parameters, and after them.
    pub(super) fn posed(
        scene: &Scene,
        parameters: &[Parameter],
        pose: &[Parameter],
    ) -> Result<Self, Error> {
        let all = [parameters, pose].concat();
        let (scene, tangents) = tangents::apply(scene, &all)?;
        let tangents = tangents.of_first(parameters.len(), &scene);
        tangents.check()?;
        Ok(Self { scene, tangents })
    }

    /// How the derivatives that a sensor sees are estimated with the least work.
    pub(super) fn estimator(
        &self,
        settings: &Settings,
        kept: &mut PreparedCache,
    ) -> Result<EstimatorKind, Error> {
        settings.check(&self.scene, true)?;
        gradients::for_motions(&self.scene, &self.tangents, settings, kept)
    }
}

/// A scene prepared at its parameters' values.
pub(super) struct ImageSource {
    session: Session,
    /// Set where derivatives are differences of images: the scene, and all changes, of which the first so many have derivatives.
    differences: Option<(Scene, Vec<Parameter>, usize)>,
    settings: Settings,
}

impl ImageSource {
    pub(super) fn new(
        scene: &Scene,
        parameters: &[Parameter],
        pose: &[Parameter],
        applied: &Applied,
        settings: Settings,
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        let Applied { scene: moved, tangents } = applied;
        if settings.estimator == EstimatorKind::FiniteDifference {
            let (moved, no_tangents) = tangents::apply(moved, &[])?;
            let session = Session::prepared(&moved, &no_tangents, &settings, kept)?;
            let differences = Some((scene.clone(), [parameters, pose].concat(), parameters.len()));
            return Ok(Self { session, differences, settings });
        }
        let session = Session::prepared(moved, tangents, &settings, kept)?;
        Ok(Self { session, differences: None, settings })
    }

    /// Image and derivatives by `spp` samples per pixel; `None` when it was cancelled.
    pub(super) fn half(
        &mut self,
        spp: u32,
        seed: u64,
        control: &dyn Control,
    ) -> Result<Option<Half>, Error> {
        self.session.restart(seed);
        if !self.session.run(spp, control) {
            return Ok(None);
        }
        let mut half = Half::from(&self.session.rendering());
        if let Some((scene, changes, wanted)) = &self.differences {
            let settings = Settings { seed, ..self.settings.clone() };
            let step = settings.step;
            let layers = finite_differences(scene, changes, &settings, spp, step, control)?;
            if layers.len() < changes.len() {
                return Ok(None);
            }
            half.derivatives = layers.iter().take(*wanted).map(means).collect();
        }
        Ok(Some(half))
    }

    /// The gradient of a loss by the items `wanted`; `None` when it was cancelled.
    pub(super) fn gradient(
        &mut self,
        wanted: &[Target],
        spp: u32,
        seed: u64,
        adjoint: &[Rgb],
        control: &dyn Control,
    ) -> Result<Option<SceneGradient>, Error> {
        self.session.restart(seed);
        let gradient = self.session.gradient(wanted, spp, adjoint, control)?;
        Ok((!control.cancelled()).then_some(gradient))
    }

    /// Shards that there can be of that.
    pub(super) fn most_shards(&self, spp: u32) -> u32 {
        if self.differences.is_some() { 1 } else { self.session.most_shards(spp) }
    }

    /// One shard of that.
    pub(super) fn half_shard(
        &mut self,
        spp: u32,
        seed: u64,
        shard: Shard,
        control: &dyn Control,
    ) -> Result<Option<ShardSums>, Error> {
        if self.differences.is_some() {
            return Err(Error::Setting { setting: "estimator", reason: SettingError::NoShards });
        }
        self.session.run_shard(spp, seed, shard, control)
    }
}
