//! Fitting parameters to pictures: the loss and gradient that one iteration needs.
//!
//! An image I is an estimate, and so is its derivative dI. Where both come from the same samples, the product of their
//! errors does not average out. Every iteration therefore takes its samples
//! in two independent halves A and B, and pairs the adjoint a = dLoss/dI of one half with the derivative of
//! the other:
//!
//! ```text
//! gradient = (⟨a(I_A), dI_B⟩ + ⟨a(I_B), dI_A⟩) / 2.
//! ```
//!
//! For any number of samples this is unbiased where the adjoint is linear in the image, as it is for squared losses
//! ([`Loss::L2`], [`Loss::PyramidL2`]). For other losses it is nearly unbiased where the
//! image's noise is small compared with its distance from the target. All samples are still used for both image and
//! derivative, and a first-order expansion shows that nothing is lost: the error is that of the
//! product with shared samples, without its bias.

mod evaluation;
mod group;
mod grouped_scene;
mod linear;
pub mod loss;
mod source;
mod step;

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::Range;

use drt_motion::Parameter;

use crate::fit::loss::{Loss, Reference};
use crate::model::error::{Error, SettingError};
use crate::model::scene::{Scene, Target};
use crate::model::settings::{EstimatorKind, Settings};
use crate::model::shard::Shard;
use crate::run::control::{Control, Part};
use crate::run::session::ShardSums;
use crate::run::session::choice::gradients;
use crate::world::cache::PreparedCache;

pub use crate::fit::evaluation::{Evaluation, Half};
pub use crate::fit::group::{Collector, Group, GroupKind};
pub use crate::fit::grouped_scene::GroupedScene;
use crate::fit::source::{Applied, ImageSource};
pub use crate::fit::step::{Misstep, check_step};

/// A sensor, and the image that it should see.
#[derive(Clone, Debug)]
pub struct View {
    /// Index of the sensor that sees it.
    pub sensor: usize,
    /// The image that it should see.
    pub reference: Reference,
    /// Known changes of the scene in this view, as of a body on a turntable: they are applied at their parameters'
    /// values, after all that is fitted. Gradients are propagated back through them.
    pub pose: Vec<Parameter>,
}

impl View {
    /// A view of the scene without a pose.
    #[must_use]
    pub fn new(sensor: usize, reference: Reference) -> Self {
        Self { sensor, reference, pose: Vec::new() }
    }
}

/// A scene, the parameters and groups that are fitted, and the views that it should match.
pub struct Fit {
    /// With the values of the groups.
    grouped: GroupedScene,
    parameters: Vec<Parameter>,
    views: Arc<[View]>,
    loss: Loss,
    settings: Settings,
    /// How each view's derivatives are estimated.
    estimators: Vec<EstimatorKind>,
    /// The scene at the values that were asked for last.
    applied: Option<Arc<Applied>>,
    /// From the last evaluation.
    kept: PreparedCache,
}

/// Between the seeds of the halves of an iteration, those of iterations being small steps apart.
const HALF: u64 = 0xd1b5_4a32_d192_ed03;

impl Fit {
    /// `scene` at its parameters' zero; their own values matter to what is chosen for [`EstimatorKind::Auto`] alone.
    /// `settings` says how images and derivatives are estimated, its sensor aside.
    ///
    /// # Errors
    /// When there is no view, a view's sensor does not exist or has a film of another size, or a number
    /// of the loss is out of its range.
    pub fn new(
        scene: Scene,
        parameters: Vec<Parameter>,
        views: Vec<View>,
        loss: Loss,
        settings: Settings,
    ) -> Result<Self, Error> {
        let fail = |reason| Err(Error::Setting { setting: "target", reason });
        loss.check()?;
        if views.is_empty() {
            return fail(SettingError::NoTarget);
        }
        for view in &views {
            let Some(sensor) = scene.sensors.get(view.sensor) else {
                let count = scene.sensors.len();
                return fail(SettingError::NoSensor { index: view.sensor, count });
            };
            let (found, film) = (view.reference.size(), sensor.item.sensor.film());
            if found != film {
                return fail(SettingError::FilmSize { found, film });
            }
        }
        let mut kept = PreparedCache::default();
        let estimators = estimators(&scene, &parameters, &[], &views, &settings, &mut kept)?;
        let (views, applied) = (views.into(), None);
        let grouped = GroupedScene::new(scene, Vec::new());
        Ok(Self { grouped, parameters, views, loss, settings, estimators, applied, kept })
    }

    /// This fit with groups of unknowns beside its parameters. They have the values of the scene until
    /// [`set_group`](Self::set_group) gives them others, and gradients come from reverse mode, whatever the number of
    /// unknowns. What is left open by [`EstimatorKind::Auto`] is chosen for the parameters and for motions of the
    /// shapes that groups change, once for each sensor, in the pose of its first view.
    ///
    /// # Errors
    /// When images are differentiated by [`EstimatorKind::FiniteDifference`], which has no reverse mode.
    pub fn with_groups(mut self, groups: Vec<Group>) -> Result<Self, Error> {
        if !groups.is_empty() && self.settings.estimator == EstimatorKind::FiniteDifference {
            return Err(Error::Setting { setting: "estimator", reason: SettingError::NoSession });
        }
        self.grouped = GroupedScene::new(self.grouped.given().clone(), groups);
        if !self.grouped.groups().is_empty() {
            let Self { grouped, parameters, views, settings, kept, .. } = &mut self;
            let (given, groups) = (grouped.given(), grouped.groups());
            self.estimators = estimators(given, parameters, groups, views, settings, kept)?;
        }
        Ok(self)
    }

    /// How each view's derivatives are estimated, without what was left open.
    #[must_use]
    pub fn estimators(&self) -> &[EstimatorKind] {
        &self.estimators
    }

    /// Gives a group other values, in the order of [`Group::values`].
    ///
    /// # Errors
    /// When there is no such group, their number is another, or one is out of its range, and when two groups decide the same
    /// values; the values then stay.
    pub fn set_group(&mut self, group: usize, values: &[f64]) -> Result<(), Error> {
        self.grouped.set(&[(group, values)])?;
        self.applied = None;
        Ok(())
    }

    /// The scene at these values of the parameters.
    ///
    /// # Errors
    /// When an effect does not fit its target there.
    pub fn scene_at(&mut self, values: &[f64]) -> Result<&Scene, Error> {
        self.apply(values)?;
        Ok(self.applied.as_ref().map_or(self.grouped.scene(), |applied| &applied.scene))
    }

    fn apply(&mut self, values: &[f64]) -> Result<Arc<Applied>, Error> {
        if values.len() != self.parameters.len() {
            let (found, parameters) = (values.len(), self.parameters.len());
            let reason = SettingError::ValueCount { found, parameters };
            return Err(Error::Setting { setting: "values", reason });
        }
        for (parameter, value) in self.parameters.iter_mut().zip(values) {
            if parameter.value.to_bits() != value.to_bits() {
                parameter.value = *value;
                self.applied = None;
            }
        }
        if let Some(applied) = &self.applied {
            return Ok(applied.clone());
        }
        let applied = Arc::new(Applied::new(self.grouped.scene(), &self.parameters)?);
        self.applied = Some(applied.clone());
        Ok(applied)
    }

    /// Loss and derivatives at these values of the parameters, from `spp` samples per pixel of each view, and at
    /// least two; the settings say how many boundary samples there are for each of them. A seed always gives
    /// one result, whatever the seed of the settings and whatever was evaluated before; parts of the scene that have
    /// not changed since are used again. `None` when `control` cancelled it.
    ///
    /// # Errors
    /// As [`Session::new`](crate::Session::new).
    pub fn evaluate(
        &mut self,
        values: &[f64],
        spp: u32,
        seed: u64,
        control: &dyn Control,
    ) -> Result<Option<Evaluation>, Error> {
        let all: Vec<usize> = (0..self.views.len()).collect();
        self.evaluate_views(values, spp, seed, &all, control)
    }

    /// As [`evaluate`](Self::evaluate), of some of the views alone: loss and derivatives are those of the views that
    /// are seen, times the number of all over that of these, as an estimate of what all would tell.
    ///
    /// # Errors
    /// As [`evaluate`](Self::evaluate), and when there is no such view.
    pub fn evaluate_views(
        &mut self,
        values: &[f64],
        spp: u32,
        seed: u64,
        views: &[usize],
        control: &dyn Control,
    ) -> Result<Option<Evaluation>, Error> {
        let mut halves = Vec::new();
        let zeros = |group: &Group| alloc::vec![0.0; group.count(self.grouped.given())];
        let mut groups: Vec<Vec<f64>> = self.grouped.groups().iter().map(zeros).collect();
        let count = views.len();
        for (k, view) in views.iter().copied().enumerate() {
            let control =
                Part::new(control, k as f64 / count as f64, (k + 1) as f64 / count as f64);
            let seen = match groups.is_empty() {
                true => self.halves(values, spp, seed, view, 0..2, &control)?,
                false => {
                    let of_groups = &mut groups;
                    self.halves_and_groups(values, spp, seed, view, of_groups, &control)?
                }
            };
            match seen.and_then(|seen| <[Half; 2]>::try_from(seen).ok()) {
                Some(seen) => halves.push(seen),
                None => return Ok(None),
            }
        }
        let seen = Evaluation::of_some(
            self.loss,
            self.views.clone(),
            views.to_vec(),
            halves,
            self.parameters.len(),
        )?;
        Ok(Some(seen.with_groups(groups)))
    }

    /// What one view's images tell, and their part in the gradients of groups: the adjoint of each half's image, times
    /// the derivatives of samples that are those of the other half.
    fn halves_and_groups(
        &mut self,
        values: &[f64],
        spp: u32,
        seed: u64,
        view: usize,
        gradients: &mut [Vec<f64>],
        control: &dyn Control,
    ) -> Result<Option<Vec<Half>>, Error> {
        let images = Part::new(control, 0.0, 0.5);
        let mut source = self.source(values, view, 2)?;
        let Some(halves) = halves_of(&mut source, spp, seed, 0..2, &images)? else {
            return Ok(None);
        };
        let applied = self.posed(values, view)?;
        let View { reference, pose, .. } = &self.views[view];
        let adjoints = [0, 1].map(|k| self.loss.adjoint(&halves[k].image, reference));
        let changes = [&self.parameters[..], pose].concat();
        let (given, groups) = (self.grouped.given(), self.grouped.groups());
        let collectors =
            groups.iter().map(|group| group.collector(given, &applied.scene, &changes));
        let collectors = collectors.collect::<Result<Vec<_>, _>>()?;
        let wanted = targets(groups);
        for (k, adjoint) in (0..2).zip(adjoints.iter().rev()) {
            let from = 0.5 + 0.25 * k as f64;
            let control = Part::new(control, from, from + 0.25);
            let seed = half_seed(seed, k);
            let found = source.gradient(&wanted, spp.div_ceil(2), seed, adjoint, &control)?;
            let Some(gradient) = found else { return Ok(None) };
            for (collector, sum) in collectors.iter().zip(&mut *gradients) {
                collector.add_to(&gradient, 0.5, sum);
            }
        }
        Ok(Some(halves))
    }

    /// What one view's images tell: some of its two halves, as [`evaluate`](Self::evaluate) takes them. `None` when
    /// `control` cancelled it.
    ///
    /// # Errors
    /// As [`evaluate`](Self::evaluate), and when there is no such view or half.
    pub fn halves(
        &mut self,
        values: &[f64],
        spp: u32,
        seed: u64,
        view: usize,
        wanted: Range<usize>,
        control: &dyn Control,
    ) -> Result<Option<Vec<Half>>, Error> {
        let mut source = self.source(values, view, wanted.end)?;
        halves_of(&mut source, spp, seed, wanted, control)
    }

    /// One shard of the samples of a half of a view. `None` when `control` cancelled it.
    ///
    /// # Errors
    /// As [`halves`](Self::halves), when there are more shards than strata of samples, or for finite differences, which
    /// have none.
    #[allow(clippy::too_many_arguments)]
    pub fn half_shard(
        &mut self,
        values: &[f64],
        spp: u32,
        seed: u64,
        view: usize,
        half: usize,
        shard: Shard,
        control: &dyn Control,
    ) -> Result<Option<ShardSums>, Error> {
        let mut source = self.source(values, view, half + 1)?;
        source.half_shard(spp.div_ceil(2), half_seed(seed, half), shard, control)
    }

    /// Shards that [`half_shard`](Self::half_shard) can make of a half of a view.
    ///
    /// # Errors
    /// As [`halves`](Self::halves).
    pub fn most_shards(&mut self, values: &[f64], spp: u32, view: usize) -> Result<u32, Error> {
        Ok(self.source(values, view, 0)?.most_shards(spp.div_ceil(2)))
    }

    /// What the halves of all views tell together, as [`evaluate`](Self::evaluate) finds them.
    ///
    /// # Errors
    /// When they are not those of this fit.
    pub fn together(&self, halves: Vec<[Half; 2]>) -> Result<Evaluation, Error> {
        Evaluation::of(self.loss, self.views.clone(), halves, self.parameters.len())
    }

    fn source(&mut self, values: &[f64], view: usize, halves: usize) -> Result<ImageSource, Error> {
        self.grouped.scene().check()?;
        let count = self.views.len();
        let Some(sensor) = self.views.get(view).filter(|_| halves <= 2).map(|v| v.sensor) else {
            let reason = SettingError::NoSensor { index: view, count };
            return Err(Error::Setting { setting: "view", reason });
        };
        let applied = self.posed(values, view)?;
        let estimator = self.estimators[view];
        let settings = Settings { sensor, estimator, terms: false, ..self.settings.clone() };
        let pose = &self.views[view].pose;
        let scene = self.grouped.scene();
        ImageSource::new(scene, &self.parameters, pose, &applied, settings, &mut self.kept)
    }

    /// The scene at these values as a view sees it.
    fn posed(&mut self, values: &[f64], view: usize) -> Result<Arc<Applied>, Error> {
        let applied = self.apply(values)?;
        match &self.views[view].pose[..] {
            [] => Ok(applied),
            pose => Applied::posed(self.grouped.scene(), &self.parameters, pose).map(Arc::new),
        }
    }
}

/// How each view's derivatives are estimated: as the settings say, or as a pilot finds out, which is the same whatever
/// the seed.
fn estimators(
    scene: &Scene,
    parameters: &[Parameter],
    groups: &[Group],
    views: &[View],
    settings: &Settings,
    kept: &mut PreparedCache,
) -> Result<Vec<EstimatorKind>, Error> {
    if settings.estimator != EstimatorKind::Auto {
        return Ok(alloc::vec![settings.estimator; views.len()]);
    }
    scene.check()?;
    let all = [gradients::probes(scene, &targets(groups)), parameters.to_vec()].concat();
    let mut of_view = |view: &View| {
        let settings = Settings { sensor: view.sensor, seed: 0, ..settings.clone() };
        let chosen = Applied::posed(scene, &all, &view.pose)
            .and_then(|applied| applied.estimator(&settings, kept));
        match chosen {
            // What a group's motions do not go with may be said by its gradient, if at all.
            Err(_) if !groups.is_empty() => Ok(EstimatorKind::PathSpace),
            chosen => chosen,
        }
    };
    if groups.is_empty() {
        return views.iter().map(of_view).collect();
    }
    // Poses of one scene seen by one sensor differ too little for a pilot of each of many.
    let mut of_sensors: Vec<Option<EstimatorKind>> = alloc::vec![None; scene.sensors.len()];
    let mut of_sensor = |view: &View| match of_sensors[view.sensor] {
        Some(known) => Ok(known),
        None => of_view(view).inspect(|kind| of_sensors[view.sensor] = Some(*kind)),
    };
    views.iter().map(&mut of_sensor).collect()
}

/// The items that groups change, each once.
fn targets(groups: &[Group]) -> Vec<Target> {
    let mut targets: Vec<Target> = Vec::new();
    for group in groups {
        let target = group.wanted();
        if !targets.contains(&target) {
            targets.push(target);
        }
    }
    targets
}

/// Some halves of the samples of a view. `None` when `control` cancelled it.
fn halves_of(
    source: &mut ImageSource,
    spp: u32,
    seed: u64,
    wanted: Range<usize>,
    control: &dyn Control,
) -> Result<Option<Vec<Half>>, Error> {
    let (first, count) = (wanted.start, wanted.len().max(1) as f64);
    let mut halves = Vec::new();
    for k in wanted {
        let from = (k - first) as f64;
        let control = Part::new(control, from / count, (from + 1.0) / count);
        match source.half(spp.div_ceil(2), half_seed(seed, k), &control)? {
            Some(half) => halves.push(half),
            None => return Ok(None),
        }
    }
    Ok(Some(halves))
}

/// The seed of one of the two halves of an iteration's samples.
fn half_seed(seed: u64, half: usize) -> u64 {
    if half == 0 { seed } else { seed.wrapping_add(HALF) }
}
