//! A scene prepared for an estimator, before anything is sampled for images.

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::derivative::contraction::Motion;
use crate::derivative::medium_motion::MediumMotions;
use crate::derivative::sensitivity::TextureUse;
use crate::derivative::tangents::Tangents;
use crate::estimators::emitter_shares::{Share, shares, slides};
use crate::estimators::{Estimator, in_scene};
use crate::model::error::Error;
use crate::model::scene::Scene;
use crate::model::settings::Settings;
use crate::run::component::Component;
use crate::run::session::path_sampling::path_sampling;
use crate::run::session::primary_share::{self, primary_share};
use crate::run::session::term_samples::{Batch, FULL, batches};
use crate::sampling::parallel::Pool;
use crate::world::World;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;

/// A scene at its parameters' values, prepared as far as no estimator matters.
pub(crate) struct Ground<'a> {
    pub(super) scene: &'a Scene,
    pub(super) tangents: &'a Tangents,
    /// Lit by all emitters.
    pub(super) world: World,
    /// The settings as they were given, and with a way to find paths in place of one that was left open.
    pub(super) asked: Settings,
    pub(super) settings: Settings,
    /// Why that way was chosen.
    pub(super) sampling: Option<String>,
    pub(super) pool: Arc<Pool>,
}

/// A component, and the samples that were taken of its terms.
pub(super) struct Part {
    pub(super) component: Component<Motion>,
    pub(super) batches: Vec<Batch>,
}

/// A scene prepared for an estimator.
pub(crate) struct Preparation {
    /// What is differentiated of the light of which emitters.
    pub(super) parts: Vec<Part>,
}

impl<'a> Ground<'a> {
    /// Prepares a scene at the parameters' values.
    pub(crate) fn new(
        scene: &'a Scene,
        tangents: &'a Tangents,
        settings: &Settings,
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        let asked = settings.clone();
        let depth = settings.max_depth.within(scene.integrator.max_depth);
        let world =
            World::new(scene.clone(), settings.sensor, depth, None, EmitterMask::All, kept)?;
        let derivatives = !tangents.names.is_empty();
        let (settings, sampling) = path_sampling(&world, scene, settings, derivatives, kept)?;
        let pool = Arc::new(Pool::new(settings.threads));
        Ok(Self { scene, tangents, world, asked, settings, sampling, pool })
    }

    /// Prepares it for an estimator.
    pub(crate) fn prepare(
        &self,
        estimator: &'static dyn Estimator,
        kept: &mut PreparedCache,
    ) -> Result<Preparation, Error> {
        let Self { scene, tangents, settings, .. } = self;
        let estimator = in_scene(estimator, scene, self.moves());
        if let Some(name) = tangents.names.first() {
            let moves = self.moves();
            let moving = tangents.targets().filter(|target| tangents.moves(*target));
            scene.refuse_derivatives(name, moves, slides(estimator, scene, settings, moving))?;
            if moves && !estimator.takes_delta_lights(scene, settings) {
                scene.refuse_delta_lights(name)?;
            }
            if tangents.move_light() {
                scene.refuse_rims(name)?;
            }
        }
        let shares = shares(estimator, scene, tangents.targets(), settings);
        let parts = shares.iter().map(|share| self.part(share, kept)).collect::<Result<_, _>>()?;
        Ok(Preparation { parts })
    }

    /// Whether light moves against what it meets or the camera.
    pub(super) fn moves(&self) -> bool {
        self.tangents.move_light() || !self.tangents.sensor.is_empty()
    }

    /// The paths of the pixels that a run is expected to take.
    pub(super) fn paths_of_run(&self) -> f64 {
        let [w, h] = self.world.camera.film();
        f64::from(w) * f64::from(h) * f64::from(self.settings.expected_spp)
    }

    /// About how many edges the scene has.
    pub(super) fn edges(&self) -> f64 {
        let triangles = self.scene.shapes.iter().map(|shape| shape.mesh.triangles.len() as f64);
        1.5 * triangles.sum::<f64>()
    }

    /// Prepares the world that a share of the light is in.
    fn part(&self, share: &Share, kept: &mut PreparedCache) -> Result<Part, Error> {
        let Share { estimator, settings, .. } = share;
        let (world, mut tangents) = (self.world.lit_by(share.lit)?, self.tangents.clone());
        for (e, emitter) in world.scene.emitters.iter().enumerate() {
            if !world.lit.by(&emitter.item.emitter) {
                tangents.emitters[e].clear();
                tangents.texels.retain(|t| t.of != TextureUse::Emitter(e));
            }
        }
        let insides = match tangents.names.is_empty() {
            true => MediumMotions::at_rest(world.scene.media.len()),
            false => {
                let insides = estimator.insides();
                MediumMotions::new(insides, &world, &tangents, &settings.insides, kept)?
            }
        };
        let component = Component::new(world, Motion::new(tangents, insides), share)?;
        let mut part = Part { component, batches: Vec::new() };
        // Else the pilot of a run measures more.
        let measures = !settings.adaptive || settings.boundary_ratio.is_some();
        if settings.guiding
            && measures
            && primary_share::of_camera(&part.component.prepared).is_some()
        {
            part.measure(FULL, &self.pool);
            let prepared = &mut part.component.prepared;
            prepared.primary_share = primary_share(prepared, &part.batches);
        }
        Ok(part)
    }
}

impl Part {
    /// Takes batches until there are so many.
    pub(super) fn measure(&mut self, count: u32, pool: &Pool) {
        let taken = self.batches.len() as u32;
        self.batches.extend(batches(&self.component, taken..u32::max(taken, count), pool));
    }
}
