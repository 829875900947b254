//! All that a gradient has numbers for: whatever the items that are wanted consist of.

use alloc::vec::Vec;

use drt_motion::interior::InteriorMotion;

use crate::derivative::medium_motion::{Insides, ReverseMediumMotions};
use crate::derivative::sensitivity::ActiveInputs;
use crate::estimators::Estimator;
use crate::model::error::Error;
use crate::model::scene::{Scene, Target};
use crate::run::component::Unknowns;
use crate::world::{ActiveFactors, MediumActivity, World};

/// What a gradient is by, and how the insides of media move with it.
pub(super) struct Everything {
    pub(super) active: ActiveInputs,
    pub(super) insides: ReverseMediumMotions,
}

impl Everything {
    /// All numbers of the items `wanted`, in a world that is lit by an estimator's light.
    pub(super) fn new(
        world: &World,
        wanted: &[Target],
        estimator: &dyn Estimator,
        asked: &[(usize, InteriorMotion)],
    ) -> Result<Self, Error> {
        let lit = world.lit;
        let mut active = active(&world.scene, wanted);
        for (e, emitter) in world.scene.emitters.iter().enumerate() {
            active.emitters[e] &= lit.by(&emitter.item.emitter);
            active.moving_emitters[e] &= lit.by(&emitter.item.emitter);
        }
        let insides = match estimator.insides() {
            Insides::Follow => ReverseMediumMotions::new(world, &active, asked)?,
            // Vertices move one by one, which no affine field follows.
            Insides::Affine | Insides::AtRest => ReverseMediumMotions::at_rest(world),
        };
        active.volumes = insides.volumes();
        Ok(Self { active, insides })
    }
}

impl Unknowns for Everything {
    fn active(&self) -> &ActiveInputs {
        &self.active
    }

    fn needs(&self) -> ActiveFactors {
        let active = &self.active;
        let need = |w: &bool| if *w { MediumActivity::Vertices } else { MediumActivity::Nothing };
        ActiveFactors {
            media: active.media.iter().map(need).collect(),
            bsdfs: active.bsdfs.clone(),
            extinctions: active.media.clone(),
            roughness: active.bsdfs.clone(),
            index: active.bsdfs.clone(),
            moves: active.moves_geometry(),
        }
    }

    fn flux_shapes(&self) -> &[usize] {
        &self.insides.flux_shapes
    }
}

/// The items that are wanted, as inputs of a scene.
pub(crate) fn active(scene: &Scene, wanted: &[Target]) -> ActiveInputs {
    fn flags(n: usize, wanted: &[Target], of: impl Fn(usize) -> Target) -> Vec<bool> {
        (0..n).map(|i| wanted.contains(&of(i))).collect()
    }
    let emitters = flags(scene.emitters.len(), wanted, Target::Emitter);
    let [moved, at_rest] = [Target::Medium, Target::Coefficients]
        .map(|kind: fn(usize) -> Target| flags(scene.media.len(), wanted, kind));
    let placed = |e: usize| {
        let emitter = &scene.emitters[e].item.emitter;
        emitter.is_delta()
    };
    ActiveInputs {
        shapes: flags(scene.shapes.len(), wanted, Target::Shape),
        volumes: alloc::vec![false; scene.media.len()],
        media: moved.iter().zip(at_rest).map(|(moved, at_rest)| *moved || at_rest).collect(),
        grids: moved,
        // Colours of glass are wanted where nothing may turn, too.
        bending: alloc::vec![false; scene.bsdfs.len()],
        bsdfs: flags(scene.bsdfs.len(), wanted, Target::Bsdf),
        moving_emitters: emitters.iter().enumerate().map(|(e, w)| *w && placed(e)).collect(),
        emitters,
        sensor: wanted.iter().any(|t| matches!(t, Target::Sensor(_))),
    }
}
