//! A run: a scene prepared once, sampled in passes, with its results available at any time.

pub(crate) mod choice;
mod component;
mod describe;
mod legend;
mod pass;
mod pilot;
mod shard;

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_motion::Parameter;

use crate::run::session::component::Component;
use crate::run::session::legend::Legend;
use crate::run::session::pass::Pass;
use crate::run::session::pilot::Pilot;
pub use crate::run::session::shard::{Merged, ShardError, ShardSums};

use crate::derivative::tangents;
use crate::derivative::tangents::Tangents;
use crate::model::error::{Error, SettingError};
use crate::model::plan::Plan;
use crate::model::rendering::Estimate;
use crate::model::rendering::{Account, Rendering, Term};
use crate::model::scene::{Scene, Target};
use crate::model::settings::{EstimatorKind, PathSampling, Settings, Warp};
use crate::sampling::allocation;
use crate::sampling::bidirectional::EmissionSampler;
use crate::sampling::film::{Blocks, PixelFilm, Raster};
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::Filling;
use crate::terms::interior::{ImageSampling, PixelSampler};
use crate::world::World;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;

/// Watches and steers a run. Every method has a default that does nothing.
pub trait Control: Sync {
    /// True to stop soon; what is finished is kept. Once true, it must stay true: work that ended early is thrown away on its word.
    fn cancelled(&self) -> bool {
        false
    }
    /// Called with the part of the current call to [`Session::run`] that is done, from 0 to 1.
    fn progress(&self, _done: f64) {}
    /// Called with each finished piece of the image, in order.
    fn tile(&self, _tile: &FinishedTile<'_>) {}
}

/// No control: run to the end in silence.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unattended;
impl Control for Unattended {}

/// Some neighbouring pixels after another round of samples.
#[derive(Clone, Copy, Debug)]
pub struct FinishedTile<'a> {
    /// First pixel and one past the last, row by row from the top left.
    pub pixels: (u32, u32),
    film: &'a PixelFilm,
}

impl FinishedTile<'_> {
    /// The forward image there so far, pixel by pixel.
    #[must_use]
    pub fn image(&self) -> impl ExactSizeIterator<Item = Estimate> {
        let (first, end) = self.pixels;
        (first..end).map(|pixel| self.film.estimate(pixel as usize, 0))
    }
}

/// A prepared scene and what has been accumulated for it.
pub struct Session {
    /// By all light, for paths.
    world: World,
    /// Each differentiates the light of some emitters.
    components: Vec<Component>,
    settings: Settings,
    plan: Plan,
    /// Where paths of light start, if there are any.
    emission: Option<EmissionSampler>,
    /// The image, and the terms of derivatives that are found along paths.
    film: PixelFilm,
    pilot: Option<Pilot>,
    account: Account,
    blocks: Arc<Blocks>,
    samples: u32,
    passes: u32,
    complete: bool,
    pool: Arc<Pool>,
}

/// Between the seeds of the boundary samples of components, whose errors must not depend on each other.
const SEED_STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// The seed of a component's boundary samples.
pub(crate) fn seed_of_component(seed: u64, i: usize) -> u64 {
    seed.wrapping_add(SEED_STEP.wrapping_mul(i as u64))
}

impl Session {
    /// Prepares `scene` at the parameters' values; without parameters, only the image is computed.
    ///
    /// # Errors
    /// When an effect does not fit its target, the scene or a setting is unusable, or parameters are to be
    /// differentiated by [`finite_differences`](crate::finite_differences), which have no session.
    pub fn new(
        scene: &Scene,
        parameters: &[Parameter],
        settings: &Settings,
    ) -> Result<Self, Error> {
        Self::with_cache(scene, parameters, settings, &mut PreparedCache::default())
    }

    /// As [`Session::new`], with what earlier sessions of nearly the same scene left to be used again. The
    /// results are the same to the bit.
    ///
    /// # Errors
    /// As [`Session::new`].
    pub fn with_cache(
        scene: &Scene,
        parameters: &[Parameter],
        settings: &Settings,
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        scene.check()?;
        if settings.estimator == EstimatorKind::FiniteDifference && !parameters.is_empty() {
            return Err(Error::Setting { setting: "estimator", reason: SettingError::NoSession });
        }
        let (scene, tangents) = tangents::apply(scene, parameters)?;
        Self::prepared(&scene, &tangents, settings, kept)
    }

    /// Prepares a scene at the parameters' values, with what earlier ones left to be used again.
    pub(crate) fn prepared(
        scene: &Scene,
        tangents: &Tangents,
        settings: &Settings,
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        let derivatives = !tangents.names.is_empty();
        settings.check(scene, derivatives)?;
        tangents.check()?;
        let tangents = tangents.seen_by(settings.sensor);
        let (settings, estimator) = choice::estimator(scene, &tangents, settings, kept)?;
        let settings = &settings;
        if let Some(name) = tangents.names.first() {
            let moves = tangents.move_light() || !tangents.sensor.is_empty();
            let moving = tangents.targets().filter(|target| tangents.moves(*target));
            let slide = slides(scene, moving, settings);
            scene.refuse_derivatives(name, moves, slide)?;
            if tangents.move_light() {
                scene.refuse_rims(name)?;
            }
        }
        let depth = settings.max_depth.within(scene.integrator.max_depth);
        let mut world =
            World::new(scene.clone(), settings.sensor, depth, None, EmitterMask::All, kept)?;
        let (settings, sampling) = choice::sampling(&world, scene, settings, derivatives, kept)?;
        let settings = &settings;
        let mut components = Vec::new();
        for (settings, lit) in estimators(scene, tangents.targets(), settings) {
            let world = world.lit_by(lit)?;
            components.push(Component::new(world, tangents.clone(), &settings, kept)?);
        }
        let needs = components.iter().filter_map(|c| Some(c.motion.as_ref()?.needs()));
        if let Some(needs) = needs.reduce(|all, needs| all.union(&needs)) {
            world.prepare_for_derivatives(needs);
        }
        let mut plan = Plan::together(components.iter().map(|c| &c.plan));
        let bidirectional = settings.sampling == PathSampling::Bidirectional;
        (plan.bidirectional, plan.sampling, plan.estimator) = (bidirectional, sampling, estimator);
        // Light's paths reach any pixel.
        plan.splatting = bidirectional || (settings.splatting && world.camera.shares_points());
        let emission = bidirectional.then(|| EmissionSampler::new(&world));
        let size = world.camera.film();
        let mut session = Self {
            film: PixelFilm::new(size, 1),
            blocks: Arc::new(Blocks::new(size)),
            pool: Arc::new(Pool::new(settings.threads)),
            settings: settings.clone(),
            pilot: None,
            account: Account::default(),
            samples: 0,
            passes: 0,
            complete: true,
            world,
            components,
            plan,
            emission,
        };
        session.film = session.new_film(settings.terms);
        session.describe_guides();
        Ok(session)
    }

    /// An empty film, with terms apart or not.
    fn new_film(&self, terms: bool) -> PixelFilm {
        let camera = &self.world.camera;
        let layers = self.layers(terms);
        if self.plan.splatting {
            PixelFilm::splatted(Raster::new(camera.filter().clone(), camera.film()), layers)
        } else {
            PixelFilm::new(camera.film(), layers)
        }
    }

    /// How the paths of the image are drawn.
    fn image_sampling(&self) -> ImageSampling {
        match (self.plan.splatting, self.plan.record) {
            (false, _) => ImageSampling::OwnPixel,
            (true, false) => ImageSampling::Squares,
            (true, true) => ImageSampling::SharedFilters,
        }
    }

    /// What will run and what is skipped.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Forgets all images, and goes on as if prepared with this seed: what comes is independent of what
    /// was.
    pub fn restart(&mut self, seed: u64) {
        self.film.clear();
        self.components.iter_mut().for_each(Component::clear);
        (self.pilot, self.account) = (None, Account::default());
        self.settings.seed = seed;
        (self.samples, self.passes, self.complete) = (0, 0, true);
        self.describe_guides();
    }

    /// Adds `spp` samples per pixel, and boundary samples in [proportion](Settings::boundary_ratio).
    /// Returns false when `control` cancelled it; the result then holds what was finished.
    pub fn run(&mut self, spp: u32, control: &dyn Control) -> bool {
        let (pool, blocks) = (Arc::clone(&self.pool), Arc::clone(&self.blocks));
        let before = self.passes;
        let pass = Pass { pool: &pool, blocks: &blocks, spp, before, shard: None, control };
        let (samples, going) = self.run_pass(&pass);
        self.samples += samples;
        self.passes += 1;
        self.complete &= going;
        going
    }

    /// Returns how many samples each pixel took, and false when it was cancelled.
    fn run_pass(&mut self, pass: &Pass<'_>) -> (u32, bool) {
        let units = pass.spp.div_ceil(self.per_unit());
        let sources = self.sources();
        if !self.learn_guides(&sources, pass) {
            return (0, false);
        }
        // The part of the work that is done when the pixels are.
        let part = if sources.is_empty() { 1.0 } else { 0.5 };
        let done = self.run_pixels(pass, units, |done| pass.control.progress(part * done));
        let mut going = done == units;
        for (k, (c, i)) in sources.iter().copied().enumerate() {
            if !going {
                break;
            }
            let seed = seed_of_component(self.settings.seed, c);
            let per_pixel = f64::from(pass.spp) * self.source_ratio(c, i);
            let progress = |done: f64| {
                let before = (k as f64 + done) / sources.len() as f64;
                pass.control.progress(part + (1.0 - part) * before);
            };
            let (account, finished) =
                self.components[c].run_source(i, seed, per_pixel, &self.world, pass, progress);
            self.account.add(account);
            going = finished;
        }
        (done * self.per_unit(), going)
    }

    /// Learns how to guide boundary samples from what a run up to the end of this pass can afford. False when it was
    /// cancelled.
    fn learn_guides(&mut self, sources: &[(usize, usize)], pass: &Pass<'_>) -> bool {
        let [w, h] = self.film.size();
        let of_pixel = f64::from(self.samples) + f64::from(pass.spp);
        for &(c, i) in sources {
            let samples = of_pixel * self.source_ratio(c, i) * f64::from(w) * f64::from(h);
            let seed = seed_of_component(self.settings.seed, c);
            let (account, going) = self.components[c].learn(i, seed, samples, &self.world, pass);
            self.account.add(account);
            if !going {
                return false;
            }
        }
        self.describe_guides();
        true
    }

    fn describe_guides(&mut self) {
        self.plan.guiding = self.components.iter().flat_map(Component::guiding).collect();
    }

    /// Samples every pixel `units` times more, or so on average; returns how often each was.
    fn run_pixels(&mut self, pass: &Pass<'_>, units: u32, progress: impl Fn(f64)) -> u32 {
        let pilot = self.pilot_units(units);
        let begun = f64::from(pilot) / f64::from(units.max(1));
        // Of a shard, too, it is all of the pilot that decides.
        let whole = Pass { shard: None, ..*pass };
        if pilot > 0 && !self.fly_pilot(&whole, pilot, |part| progress(begun * part)) {
            return 0;
        }
        let tile = |film: &PixelFilm, pixels: core::ops::Range<u32>| {
            pass.control.tile(&FinishedTile { pixels: (pixels.start, pixels.end), film });
        };
        let mut film = core::mem::take(&mut self.film);
        let rest = |part| progress(begun + (1.0 - begun) * part);
        let (seed, terms) = (self.settings.seed, self.settings.terms);
        let (account, done) = self.fill(&mut film, seed, terms, pass, units - pilot, tile, rest);
        self.account.add(account);
        self.film = film;
        done + pilot
    }

    /// Units of each pixel that the pilot takes of these, where there is one to come.
    fn pilot_units(&self, units: u32) -> u32 {
        let wanted = self.settings.adaptive && self.pilot.is_none();
        allocation::pilot(units).filter(|_| wanted).unwrap_or(0)
    }

    /// Takes samples of pixels; returns how many of each were finished.
    #[allow(clippy::too_many_arguments)]
    fn fill(
        &self,
        film: &mut PixelFilm,
        seed: u64,
        terms: bool,
        pass: &Pass<'_>,
        units: u32,
        tile: impl FnMut(&PixelFilm, core::ops::Range<u32>),
        progress: impl Fn(f64),
    ) -> (Account, u32) {
        let queries = self.pilot.as_ref().and_then(|p| p.budget.as_ref()).map(|b| b.queries);
        let filling = Filling {
            pool: pass.pool,
            seed,
            allocation: self.pilot.as_ref().map(|p| &p.pixels),
            shard: pass.shard,
            sampler: || {
                let components = self.components.iter().filter_map(|c| c.of_paths(queries));
                PixelSampler::new(&self.world, components, seed, self.plan.antithetic, terms)
                    .with_image(self.image_sampling())
                    .with_light_paths(self.emission.as_ref())
            },
            cancelled: &|| pass.control.cancelled(),
        };
        let mut account = Account::default();
        let finished = |sampler: PixelSampler<'_, _>, part| {
            account.add(sampler.account());
            progress(part);
            !pass.control.cancelled()
        };
        let done = filling.fill(film, units, finished, tile);
        (account, done)
    }

    /// Paths of a sample of a pixel.
    fn per_unit(&self) -> u32 {
        if self.plan.antithetic { 2 } else { 1 }
    }

    /// All sources of boundary samples: component, and index among its own.
    fn sources(&self) -> Vec<(usize, usize)> {
        let of = |(c, component): (usize, &Component)| {
            (0..component.prepared.sources.len()).map(move |i| (c, i))
        };
        self.components.iter().enumerate().flat_map(of).collect()
    }

    /// Samples of a source to each of a pixel.
    fn source_ratio(&self, c: usize, i: usize) -> f64 {
        let budget = self.pilot.as_ref().and_then(|pilot| pilot.budget.as_ref());
        budget.map_or_else(
            || self.components[c].prepared.source_ratio(i),
            |budget| budget.sources[self.sources().iter().position(|s| *s == (c, i)).unwrap_or(0)],
        )
    }

    /// Samples of a batch of a source, in a pass of so many of each pixel.
    fn per_batch(&self, spp: u32, c: usize, i: usize) -> u32 {
        let per_pixel = f64::from(spp) * self.source_ratio(c, i);
        self.components[c].per_batch(i, per_pixel)
    }

    fn parameters(&self) -> usize {
        self.components[0].motion.as_ref().map_or(0, |m| m.parameters())
    }

    /// Terms found along paths, in the order of their layers.
    fn terms(&self) -> impl Iterator<Item = Term> {
        self.components.iter().flat_map(|c| c.prepared.along_rays().terms().collect::<Vec<_>>())
    }

    /// Layers of a pixel's samples: the image, a derivative per parameter, and if terms are kept apart one per
    /// term and parameter.
    fn layers(&self, terms: bool) -> usize {
        let apart = if terms { self.terms().count() } else { 0 };
        1 + self.parameters() * (1 + apart)
    }

    /// The images so far.
    #[must_use]
    pub fn rendering(&self) -> Rendering {
        Rendering {
            image: self.film.layer(0, &self.blocks),
            derivatives: self.legend().derivatives(
                &self.film,
                self.components.iter().flat_map(Component::splats),
                &self.blocks,
            ),
            plan: self.plan.clone(),
            counters: self.account.counters,
            non_finite: self.account.non_finite_count,
            non_finite_examples: self.account.non_finite.clone(),
            spp: self.samples,
            complete: self.complete,
        }
    }

    fn legend(&self) -> Legend {
        let components = self.components.iter();
        Legend {
            size: self.film.size(),
            splatted: self.plan.splatting,
            parameters: self.names(),
            along: self.terms().filter(|_| self.settings.terms).collect(),
            sources: components.flat_map(Component::terms).collect(),
            apart: self.settings.terms,
        }
    }

    fn names(&self) -> Vec<String> {
        self.components[0].motion.as_ref().map_or_else(Vec::new, |m| m.tangents.names.clone())
    }
}

/// Whether what a target changes may move.
pub(crate) fn may_move(scene: &Scene, target: Target) -> bool {
    match target {
        Target::Shape(_) | Target::Sensor(_) => true,
        Target::Bsdf(_) => false,
        Target::Medium(m) => scene.media.get(m).is_some_and(|m| m.item.homogeneous().is_none()),
        Target::Emitter(e) => scene.emitters.get(e).is_some_and(|e| e.item.emitter.is_delta()),
    }
}

/// Whether vertices of paths slide over surfaces as the targets change.
pub(crate) fn slides(
    scene: &Scene,
    targets: impl IntoIterator<Item = Target>,
    settings: &Settings,
) -> bool {
    let material = settings.estimator == EstimatorKind::PathSpace;
    !material && targets.into_iter().any(|target| may_move(scene, target))
}

/// Which estimator differentiates which light: points and directions do not fit the 2019 form (theory sheet
/// §3), which leaves them to path space where one of the targets may move. Rays that turn with edges turn with their shadows as
/// well, but on surfaces alone.
pub(crate) fn estimators(
    scene: &Scene,
    targets: impl IntoIterator<Item = Target>,
    settings: &Settings,
) -> Vec<(Settings, EmitterMask)> {
    let may_move = |target| may_move(scene, target);
    let emitters = || scene.emitters.iter().map(|e| &e.item.emitter);
    let mut shares = Vec::new();
    let volumes = !scene.media.is_empty() || scene.bsdfs.iter().any(|b| b.item.is_null());
    let fits = match settings.estimator {
        EstimatorKind::Radiative => false,
        // What lies behind a connection turns alike for all light that it brings.
        EstimatorKind::Warped => {
            let from_camera = settings.sampling == PathSampling::Unidirectional;
            !volumes && matches!(settings.warp, Warp::Edges) && from_camera
        }
        _ => true,
    };
    if !fits && emitters().any(|e| e.is_delta()) && targets.into_iter().any(may_move) {
        shares.push((EstimatorKind::PathSpace, EmitterMask::Delta));
        let media = scene.media.iter().any(|m| m.item.is_emissive());
        if media || emitters().any(|e| !e.is_delta()) {
            shares.push((settings.estimator, EmitterMask::Extended));
        }
    } else {
        shares.push((settings.estimator, EmitterMask::All));
    }
    // They share what is said of boundary samples; what is not, each finds out.
    let said = settings.boundary_ratio.or((!settings.adaptive).then_some(1.0));
    let boundary_ratio = said.map(|all| all / shares.len() as f64);
    let own = |(estimator, lit)| (Settings { estimator, boundary_ratio, ..settings.clone() }, lit);
    shares.into_iter().map(own).collect()
}
