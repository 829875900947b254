//! Where images and derivatives come from.

use drt_motion::Parameter;

use crate::derivative::tangents;
use crate::derivative::tangents::Tangents;
use crate::fit::evaluation::{Half, means};
use crate::model::error::{Error, SettingError};
use crate::model::scene::Scene;
use crate::model::settings::{EstimatorKind, Settings};
use crate::model::shard::Shard;
use crate::run::control::Control;
use crate::run::finite_difference::finite_differences;
use crate::run::session::{Session, ShardSums, choice};
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

    /// How the derivatives that a sensor sees are estimated with the least work.
    pub(super) fn estimator(
        &self,
        settings: &Settings,
        kept: &mut PreparedCache,
    ) -> Result<EstimatorKind, Error> {
        settings.check(&self.scene, true)?;
        let tangents = self.tangents.seen_by(settings.sensor);
        Ok(choice::estimator(&self.scene, &tangents, settings, kept)?.0.estimator)
    }
}

/// A scene prepared at its parameters' values.
pub(super) struct ImageSource<'a> {
    session: Session,
    /// Set where derivatives are differences of images.
    differences: Option<(&'a Scene, &'a [Parameter])>,
    settings: Settings,
}

impl<'a> ImageSource<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        parameters: &'a [Parameter],
        applied: &Applied,
        settings: Settings,
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        let Applied { scene: moved, tangents } = applied;
        if settings.estimator == EstimatorKind::FiniteDifference {
            let (moved, no_tangents) = tangents::apply(moved, &[])?;
            let session = Session::prepared(&moved, &no_tangents, &settings, kept)?;
            return Ok(Self { session, differences: Some((scene, parameters)), settings });
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
        if let Some((scene, parameters)) = self.differences {
            let settings = Settings { seed, ..self.settings.clone() };
            let step = settings.step;
            let layers = finite_differences(scene, parameters, &settings, spp, step, control)?;
            if layers.len() < parameters.len() {
                return Ok(None);
            }
            half.derivatives = layers.iter().map(means).collect();
        }
        Ok(Some(half))
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
