//! Gradients of losses from a session's preparation.

use alloc::borrow::Cow;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::Rgb;

use crate::derivative::scene_gradient::SceneGradient;
use crate::estimators::emitter_shares::{may_move, slides};
use crate::estimators::{Estimator, in_scene, named};
use crate::model::error::Error;
use crate::model::scene::{Scene, Target, TargetName};
use crate::model::settings::{EstimatorKind, PathSampling, Settings};
use crate::model::shard::Shard;
use crate::run::control::Control;
use crate::run::gradient::{GradientBatch, PreparedGradient, Sampling, active};
use crate::run::session::Session;
use crate::run::session::choice::gradients;
use crate::world::World;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;

/// What a session keeps of its last gradient.
#[derive(Default)]
pub(super) struct Gradient {
    /// The items that it was with respect to.
    wanted: Vec<Target>,
    /// The estimator that was chosen for these items.
    estimator: Option<EstimatorKind>,
    prepared: Option<PreparedGradient>,
}

impl Gradient {
    /// The same choice for a scene that has changed.
    pub(super) fn unprepared(&mut self) -> Self {
        Self { prepared: None, ..core::mem::take(self) }
    }
}

impl Session {
    /// The gradient of a loss with respect to the items `wanted` of the scene at the parameters' values, from `spp`
    /// samples per pixel, and boundary samples in [proportion](Settings::boundary_ratio). `adjoint` holds ∂Loss/∂I per
    /// pixel and channel, row by row from the top left. Preparations for these items are used again when they are
    /// wanted again. The samples of the session's images are not used for gradients; but with the seed of the images,
    /// the errors of gradient and images are correlated.
    ///
    /// The inside of a medium moves with the shapes around it as follows:
    ///
    /// * By default it is filled with tetrahedra between the shapes that touch it and the cameras and point lights in
    ///   it. The gradients at their vertices are added to those of the shapes. Making the tetrahedra takes 0.05 to 0.25
    ///   s per 1000 vertices.
    /// * It stays at rest, and the flux through the shapes that are wanted is added, where no paths have vertices on
    ///   the items that are wanted (null and black surfaces), where shapes pass through each other, where
    ///   [`Settings::insides`] asks for [`InteriorMotion::Static`](crate::InteriorMotion::Static), and by
    ///   [`EstimatorKind::Radiative`](crate::EstimatorKind::Radiative).
    /// * Tetrahedra that [`Settings::insides`] gives are used, without the velocities that are given with them. Other
    ///   kinds of motion in [`Settings::insides`] are ignored.
    ///
    /// A BSDF has an entry for each of the properties that it is [differentiated](crate::surface::Bsdf::differentiated) by, except the index of
    /// refraction of smooth interfaces. It turns light, as a motion does, and has a derivative in forward mode alone.
    ///
    /// The expected value does not depend on this choice. Forward mode is the exact transpose if it has this seed,
    /// these settings, which name an estimator, and this `spp`, without [`guiding`](Settings::guiding), and if both modes ask for one of the
    /// kinds above. Shapes that touch and move differently are an exception: no field follows both, and the flux
    /// through the shape that is not followed is added here.
    ///
    /// Where the settings leave the [estimator open](crate::EstimatorKind::Auto), the first gradient with respect to
    /// these items chooses it for a run of `spp` samples per pixel, and the choice stays.
    ///
    /// # Errors
    /// When a name is not that of one item, the adjoint's size is not the film's, the scene or a setting is unusable,
    /// or tetrahedra that [`Settings::insides`] asks for cannot be made.
    pub fn gradient(
        &mut self,
        wanted: &[impl TargetName],
        spp: u32,
        adjoint: &[Rgb],
        control: &dyn Control,
    ) -> Result<SceneGradient, Error> {
        let mut sums: Option<[SceneGradient; 2]> = None;
        self.gradient_in_batches(wanted, spp, adjoint, None, control, &mut |batch| {
            let parts = [batch.pixels, batch.boundary];
            match &mut sums {
                None => sums = Some(parts),
                Some(sums) => sums.iter_mut().zip(parts).for_each(|(sum, part)| sum.add(part)),
            }
        })?;
        if let Some([mut pixels, boundary]) = sums {
            pixels.add(boundary);
            return Ok(pixels);
        }
        // It was cancelled before anything was done.
        Ok(self.prepared_gradient(wanted, spp)?.zeros())
    }

    /// A [`gradient`](Self::gradient) in parts: calls `each` with every batch of samples, or with those of a shard, as
    /// they are finished, in order. The batches do not depend on how they are shared among machines. False when
    /// `control` cancelled it.
    ///
    /// # Errors
    /// As [`gradient`](Self::gradient), and when there are more shards than batches.
    pub fn gradient_in_batches(
        &mut self,
        wanted: &[impl TargetName],
        spp: u32,
        adjoint: &[Rgb],
        shard: Option<Shard>,
        control: &dyn Control,
        each: &mut dyn FnMut(GradientBatch),
    ) -> Result<bool, Error> {
        let (pool, seed) = (Arc::clone(&self.pool), self.asked.seed);
        let prepared = self.prepared_gradient(wanted, spp)?;
        prepared.run(&Sampling { pool: &pool, seed, spp, adjoint, shard, control }, each)
    }

    /// What is prepared for a gradient by some items, of which a run takes `spp` samples per pixel.
    fn prepared_gradient(
        &mut self,
        wanted: &[impl TargetName],
        spp: u32,
    ) -> Result<&mut PreparedGradient, Error> {
        let world = &self.world;
        let expanded = world.scene.expanded()?;
        let scene = &*expanded;
        let wanted: Vec<Target> =
            wanted.iter().map(|w| w.find_in(scene)).collect::<Result<_, _>>()?;
        let known = core::mem::take(&mut self.gradient);
        let known = if known.wanted == wanted { known } else { Gradient::default() };
        let prepared = match known.prepared {
            Some(prepared) => {
                self.gradient = Gradient { wanted, estimator: known.estimator, prepared: None };
                prepared
            }
            None => {
                let settings = Settings { expected_spp: spp, ..self.asked.clone() };
                self.asked.check(scene, true)?;
                let choose = || gradients::for_items(scene, &wanted, &settings, &mut self.kept);
                let kind = known.estimator.unwrap_or_else(choose);
                let estimator = named(kind);
                let prepared = match &expanded {
                    Cow::Borrowed(_) => self.prepare_gradient(estimator, world, &wanted)?,
                    // Instances have no derivatives but as shapes of their own.
                    Cow::Owned(scene) => {
                        let Settings { sensor, max_depth, .. } = self.asked;
                        let depth = max_depth.within(scene.integrator.max_depth);
                        let mut kept = PreparedCache::default();
                        let scene = scene.clone();
                        let world =
                            World::new(scene, sensor, depth, None, EmitterMask::All, &mut kept)?;
                        self.prepare_gradient(estimator, &world, &wanted)?
                    }
                };
                self.gradient = Gradient { wanted, estimator: Some(kind), prepared: None };
                prepared
            }
        };
        Ok(self.gradient.prepared.insert(prepared))
    }

    fn prepare_gradient(
        &self,
        estimator: &'static dyn Estimator,
        world: &World,
        wanted: &[Target],
    ) -> Result<PreparedGradient, Error> {
        let scene = &*world.scene;
        let moves = active(scene, wanted).moves_geometry();
        let estimator = in_scene(estimator, scene, moves);
        if let Some(target) = wanted.first() {
            let slide = slides(estimator, scene, &self.asked, wanted.iter().copied());
            scene.refuse_derivatives(&scene.name_of(*target), moves, slide)?;
            if moves && !estimator.takes_delta_lights(scene, &self.asked) {
                scene.refuse_delta_lights(&scene.name_of(*target))?;
            }
            let light = |t: &Target| !matches!(t, Target::Sensor(_)) && may_move(scene, *t);
            if let Some(target) = wanted.iter().find(|target| light(target)) {
                scene.refuse_rims(&scene.name_of(*target))?;
            }
        }
        PreparedGradient::new(estimator, world, wanted, &self.asked)
    }
}

/// The gradient of a loss with respect to the items `wanted` of a scene: [`Session::gradient`] of a session that is
/// used once.
///
/// # Errors
/// As [`Session::gradient`].
pub fn gradient(
    scene: &Scene,
    wanted: &[impl TargetName],
    settings: &Settings,
    spp: u32,
    adjoint: &[Rgb],
    control: &dyn Control,
) -> Result<SceneGradient, Error> {
    once(scene, settings)?.gradient(wanted, spp, adjoint, control)
}

/// A [`gradient`] in parts: [`Session::gradient_in_batches`] of a session that serves once.
///
/// # Errors
/// As [`Session::gradient_in_batches`].
#[allow(clippy::too_many_arguments)]
pub fn gradient_in_batches(
    scene: &Scene,
    wanted: &[impl TargetName],
    settings: &Settings,
    spp: u32,
    adjoint: &[Rgb],
    shard: Option<Shard>,
    control: &dyn Control,
    each: &mut dyn FnMut(GradientBatch),
) -> Result<bool, Error> {
    once(scene, settings)?.gradient_in_batches(wanted, spp, adjoint, shard, control, each)
}

/// A session that no image is asked of.
fn once(scene: &Scene, settings: &Settings) -> Result<Session, Error> {
    let sampling = match settings.sampling {
        PathSampling::Auto => PathSampling::Unidirectional,
        named => named,
    };
    Session::new(scene, &[], &Settings { sampling, ..settings.clone() })
}
