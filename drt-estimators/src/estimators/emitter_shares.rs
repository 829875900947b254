//! Which estimator differentiates which light.

use alloc::vec::Vec;

use crate::estimators::Estimator;
use crate::estimators::path_space::PathSpace;
use crate::model::refusals::Sliding;
use crate::model::scene::{Scene, Target};
use crate::model::settings::Settings;
use crate::world::lights::EmitterMask;

/// An estimator, and the light that it differentiates.
pub(crate) struct Share {
    pub(crate) estimator: &'static dyn Estimator,
    pub(crate) lit: EmitterMask,
    /// With its part of the boundary samples.
    pub(crate) settings: Settings,
}

/// Leaves to path space the light of points and directions that an estimator does not fit, where one of the targets may move.
pub(crate) fn shares(
    estimator: &'static dyn Estimator,
    scene: &Scene,
    targets: impl IntoIterator<Item = Target>,
    settings: &Settings,
) -> Vec<Share> {
    let may_move = |target| may_move(scene, target);
    let emitters = || scene.emitters.iter().map(|e| &e.item.emitter);
    let mut shares: Vec<(&'static dyn Estimator, EmitterMask)> = Vec::new();
    let fits = estimator.takes_delta_lights(scene, settings);
    if !fits && emitters().any(|e| e.is_delta()) && targets.into_iter().any(may_move) {
        shares.push((&PathSpace, EmitterMask::Delta));
        let media = scene.media.iter().any(|m| m.item.is_emissive());
        if media || emitters().any(|e| !e.is_delta()) {
            shares.push((estimator, EmitterMask::Extended));
        }
    } else {
        shares.push((estimator, EmitterMask::All));
    }
    // They share what is said of boundary samples; what is not, each finds out.
    let said = settings.boundary_ratio.or((!settings.adaptive).then_some(1.0));
    let boundary_ratio = said.map(|all| all / shares.len() as f64);
    let settings = Settings { boundary_ratio, ..settings.clone() };
    let share = |(estimator, lit)| Share { estimator, lit, settings: settings.clone() };
    shares.into_iter().map(share).collect()
}

/// Whether what a target changes may move.
pub(crate) fn may_move(scene: &Scene, target: Target) -> bool {
    match target {
        Target::Shape(_) | Target::Sensor(_) => true,
        Target::Bsdf(_) | Target::Coefficients(_) => false,
        Target::Medium(m) => scene.media.get(m).is_some_and(|m| m.item.homogeneous().is_none()),
        Target::Emitter(e) => scene.emitters.get(e).is_some_and(|e| e.item.emitter.is_delta()),
    }
}

/// How vertices of paths slide over surfaces as the targets change.
pub(crate) fn slides(
    estimator: &dyn Estimator,
    scene: &Scene,
    settings: &Settings,
    targets: impl IntoIterator<Item = Target>,
) -> Sliding {
    let moves = targets.into_iter().any(|target| may_move(scene, target));
    if moves { estimator.slides(settings) } else { Sliding::Nowhere }
}
