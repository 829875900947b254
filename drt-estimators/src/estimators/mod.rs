//! Estimators of derivatives.
//!
//! The derivative of a path integral has an interior term, which is the derivative of the integrand as the vertices of
//! paths move with some velocity field, and terms for the jumps of the integrand that do not move with that field. An
//! [`Estimator`] chooses the velocity field, and the [`Terms`] that together are the derivative for it; the code that
//! samples these terms does not know which estimator it is.

pub(crate) mod emitter_shares;
mod orthographic_refusals;
pub(crate) mod path_space;
pub(crate) mod radiative;
pub(crate) mod warped;

use crate::derivative::contraction::Motion;
use crate::derivative::medium_motion::Insides;
use crate::derivative::sensitivity::ActiveInputs;
use crate::estimators::path_space::PathSpace;
use crate::estimators::radiative::Radiative;
use crate::estimators::warped::Warped;
use crate::model::error::Error;
use crate::model::refusals::Sliding;
use crate::model::scene::Scene;
use crate::model::settings::{EstimatorKind, PathSampling, Settings};
use crate::sampling::bidirectional::EmissionSampler;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::flux::{Flux, GrazingFlux};
use crate::terms::prepared::Prepared;
use crate::terms::selected::Terms;
use crate::world::World;

/// A way to estimate derivatives.
pub(crate) trait Estimator: Sync {
    /// The name that plans and messages give it.
    fn name(&self) -> &'static str;

    /// How the insides of media move by default.
    fn insides(&self) -> Insides;

    /// Whether vertices slide over surfaces as something moves, and over what.
    fn slides(&self, settings: &Settings) -> Sliding;

    /// Whether its terms include the light of point, spot and directional emitters where something moves.
    fn takes_delta_lights(&self, scene: &Scene, settings: &Settings) -> bool;

    /// The velocity field of vertices, and the terms, for what changes in a world.
    ///
    /// # Errors
    /// When it has no derivative of that.
    fn terms(&self, world: &World, changes: &Changes<'_>) -> Result<Terms, Error>;
}

/// What changes in a world, and the settings of its derivative.
pub(crate) struct Changes<'a> {
    pub(crate) active: &'a ActiveInputs,
    /// Shapes beside media whose insides do not follow them.
    pub(crate) flux_shapes: &'a [usize],
    pub(crate) settings: &'a Settings,
    /// Which edges move how fast, where that is known.
    pub(crate) motion: Option<&'a Motion>,
}

/// The estimator that a kind names. A kind that is no estimator of a session gives the default one, which
/// differentiates nothing where there are no parameters.
pub(crate) fn named(kind: EstimatorKind) -> &'static dyn Estimator {
    match kind {
        EstimatorKind::Radiative => &Radiative,
        EstimatorKind::Warped => &Warped,
        EstimatorKind::PathSpace | EstimatorKind::FiniteDifference | EstimatorKind::Auto => {
            &PathSpace
        }
    }
}

/// Why, where something moves in a scene, [`Warped`] is the only estimator for it; `None` where it is not.
///
/// Past smooth surfaces light follows from what comes before, so that only vertices which move with their rays, and rays which turn with
/// what they meet there, have a derivative. Where the camera does not see emitters, what it sees beside an edge is not what other edge
/// samples find there.
pub(crate) fn warped_alone(scene: &Scene) -> Option<&'static str> {
    if scene.first_smooth().is_some() {
        Some("of all estimators it alone has derivatives past smooth surfaces")
    } else if scene.hides_something() {
        Some("of all estimators it alone knows what `hide_emitters` hides")
    } else {
        None
    }
}

/// The estimator that serves in place of the one that is asked for, where something `moves` in a scene.
pub(crate) fn in_scene(
    asked: &'static dyn Estimator,
    scene: &Scene,
    moves: bool,
) -> &'static dyn Estimator {
    if moves && warped_alone(scene).is_some() { &Warped } else { asked }
}

/// Prepares a world for an estimator.
///
/// # Errors
/// As [`Estimator::terms`].
pub(crate) fn prepare(
    estimator: &dyn Estimator,
    world: World,
    changes: &Changes<'_>,
) -> Result<Prepared, Error> {
    // Without anything to differentiate, all are the same.
    let estimator = if changes.active.any() { estimator } else { &PathSpace };
    let terms = estimator.terms(&world, changes)?;
    orthographic_refusals::refuse_cuts(&world, changes)?;
    Ok(Prepared::new(estimator.name(), world, terms))
}

impl Terms {
    /// Adds the light paths of paths from both ends, where these are asked for.
    fn add_light_paths(&mut self, world: &World, changes: &Changes<'_>) {
        let Changes { active, settings, .. } = changes;
        let bidirectional = settings.sampling == PathSampling::Bidirectional && active.any();
        self.sources.extend(bidirectional.then_some(BoundarySource::LightPaths));
        self.emission = bidirectional.then(|| EmissionSampler::new(world));
        self.lobe_pairs = settings.antithetic && self.emission.is_none();
    }

    /// Adds a flux, and what the camera sees of it edge on as one more source.
    fn add_flux(
        &mut self,
        world: &World,
        flux: Option<Flux>,
        active: &ActiveInputs,
    ) -> Result<(), Error> {
        if let Some(flux) = &flux {
            self.grazing_flux = GrazingFlux::new(world, flux, active)?;
            self.sources.extend(self.grazing_flux.as_ref().map(|_| BoundarySource::GrazingFlux));
        }
        self.flux = flux;
        Ok(())
    }

    /// Divides the boundary samples that are asked for among some kinds of them.
    fn share_samples(&mut self, settings: &Settings, kinds: usize) {
        self.boundary_ratio = settings.boundary_ratio.unwrap_or(1.0) / kinds.max(1) as f64;
    }
}

/// Whether image points come in mirrored pairs. The filter's rate is what they cancel; without it they only cost.
fn mirrors(world: &World, changes: &Changes<'_>) -> bool {
    let Changes { active, settings, .. } = changes;
    settings.antithetic && active.moves_geometry() && world.camera.filter().is_continuous()
}
