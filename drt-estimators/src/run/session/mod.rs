//! Sessions: a scene is prepared once and sampled in passes, and its results are available at any time.

pub(crate) mod choice;
mod describe;
mod gradient;
mod images;
mod legend;
mod pass;
mod path_sampling;
mod pilot;
pub(crate) mod preparation;
mod primary_share;
mod shard;
mod term_samples;

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_motion::Parameter;

use crate::derivative::tangents;
use crate::derivative::tangents::Tangents;
use crate::model::error::{Error, SettingError};
use crate::model::plan::Plan;
use crate::model::rendering::{Account, Rendering, Term};
use crate::model::scene::Scene;
use crate::model::settings::{EstimatorKind, PathSampling, Settings};
use crate::run::component::{Unknowns, seed_of_component};
use crate::run::control::{Control, FinishedTile};
use crate::run::session::choice::Chosen;
use crate::run::session::gradient::Gradient;
use crate::run::session::images::Images;
use crate::run::session::legend::Legend;
use crate::run::session::pass::Pass;
use crate::run::session::pilot::Pilot;
use crate::run::session::preparation::{Ground, Preparation};
use crate::sampling::allocation;
use crate::sampling::bidirectional::EmissionSampler;
use crate::sampling::film::{Blocks, PixelFilm, Raster};
use crate::sampling::parallel::Pool;
use crate::sampling::pixels::Filling;
use crate::terms::interior::{ImageSampling, PixelSampler};
use crate::world::World;
use crate::world::cache::PreparedCache;

pub use crate::run::session::gradient::{gradient, gradient_in_batches};
pub use crate::run::session::shard::{Merged, ShardError, ShardSums};

/// A prepared scene and the samples taken of it so far. [`run`](Session::run) accumulates its image and derivative
/// images; [`gradient`](Session::gradient) estimates, from this preparation, the gradient of a loss with respect to all
/// quantities of the scene.
pub struct Session {
    /// Lit by all emitters.
    world: World,
    /// That world, with the settings of paths that derivative images need.
    paths: World,
    /// Each differentiates the light of some emitters.
    images: Vec<Images>,
    /// The settings as they were given, and with all choices made.
    asked: Settings,
    settings: Settings,
    gradient: Gradient,
    /// What the next preparation can use again.
    kept: PreparedCache,
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
        let mut kept = PreparedCache::default();
        let mut session = Self::with_cache(scene, parameters, settings, &mut kept)?;
        session.kept = kept;
        Ok(session)
    }

    /// Goes on with this scene at other values: vertices that have moved, other voxels, texels or numbers, other
    /// values of the parameters. All accumulated samples are discarded. Preparations of parts that have not changed are
    /// used again; the results are those of a new session, to the bit, except that an estimator which was
    /// [chosen](EstimatorKind::Auto) for a gradient is kept as long as gradients with respect to the same items are asked for.
    ///
    /// # Errors
    /// As [`Session::new`]; the session then stays as it was.
    pub fn update(&mut self, scene: &Scene, parameters: &[Parameter]) -> Result<(), Error> {
        let mut kept = core::mem::take(&mut self.kept);
        let updated = Self::with_cache(scene, parameters, &self.asked, &mut kept);
        self.kept = kept;
        let (kept, pool) = (core::mem::take(&mut self.kept), Arc::clone(&self.pool));
        match updated {
            Ok(updated) => {
                let gradient = self.gradient.unprepared();
                *self = Self { kept, pool, gradient, ..updated };
            }
            Err(error) => {
                self.kept = kept;
                return Err(error);
            }
        }
        Ok(())
    }

    /// As [`Session::new`], but with preparations that earlier sessions of a similar scene have left in the cache. The
    /// results are those of [`Session::new`] to the bit.
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
        let ground = Ground::new(scene, &tangents, settings, kept)?;
        let Chosen { preparation, why, .. } = choice::estimator(&ground, kept)?;
        let mut session = Self::of(ground, preparation);
        session.plan.estimator = why;
        Ok(session)
    }

    /// A session without samples.
    pub(crate) fn of(ground: Ground<'_>, preparation: Preparation) -> Self {
        let parts = preparation.parts;
        let Ground { world, asked, settings, sampling, pool, .. } = ground;
        let images: Vec<Images> = parts.into_iter().map(|p| Images::new(p.component)).collect();
        let mut paths = world.clone();
        let needs = images.iter().map(|images| images.component.unknowns.needs());
        if let Some(needs) = needs.reduce(|all, needs| all.union(&needs)) {
            paths.prepare_for_derivatives(needs);
        }
        let plans: Vec<Plan> = images.iter().map(|i| describe::describe(&i.component)).collect();
        let mut plan = Plan::together(plans.iter());
        let bidirectional = settings.sampling == PathSampling::Bidirectional;
        (plan.bidirectional, plan.sampling) = (bidirectional, sampling);
        // Light's paths reach any pixel.
        plan.splatting = bidirectional || (settings.splatting && world.camera.shares_points());
        let emission = bidirectional.then(|| EmissionSampler::new(&paths));
        let size = world.camera.film();
        let mut session = Self {
            film: PixelFilm::new(size, 1),
            blocks: Arc::new(Blocks::new(size)),
            pool,
            pilot: None,
            account: Account::default(),
            samples: 0,
            passes: 0,
            complete: true,
            gradient: Gradient::default(),
            kept: PreparedCache::default(),
            asked,
            settings,
            world,
            paths,
            images,
            plan,
            emission,
        };
        session.film = session.new_film(session.settings.terms);
        session.describe_guides();
        session
    }

    /// An empty film, with terms apart or not.
    fn new_film(&self, terms: bool) -> PixelFilm {
        let camera = &self.paths.camera;
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

    /// Discards all samples, and goes on as if prepared with this seed: later samples are independent of the earlier
    /// ones.
    pub fn restart(&mut self, seed: u64) {
        self.film.clear();
        self.images.iter_mut().for_each(Images::clear);
        (self.pilot, self.account) = (None, Account::default());
        (self.settings.seed, self.asked.seed) = (seed, seed);
        (self.samples, self.passes, self.complete) = (0, 0, true);
        self.describe_guides();
    }

    /// Adds `spp` samples per pixel, and boundary samples in [proportion](Settings::boundary_ratio).
    /// Returns false when `control` cancelled it; the result then has the samples that were finished.
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
                self.images[c].run_source(i, seed, per_pixel, &self.paths, pass, progress);
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
        for (c, images) in self.images.iter_mut().enumerate() {
            let seed = seed_of_component(self.settings.seed, c);
            let cancelled = || pass.control.cancelled();
            let component = &mut images.component;
            let (account, going) = component.learn_levels(seed, pass.spp, pass.pool, &cancelled);
            self.account.add(account);
            if !going {
                return false;
            }
        }
        for &(c, i) in sources {
            let samples = of_pixel * self.source_ratio(c, i) * f64::from(w) * f64::from(h);
            let seed = seed_of_component(self.settings.seed, c);
            let (account, going) = self.images[c].learn(i, seed, samples, &self.paths, pass);
            self.account.add(account);
            if !going {
                return false;
            }
        }
        self.describe_guides();
        true
    }

    fn describe_guides(&mut self) {
        let guides = self.images.iter().flat_map(|images| images.component.describe_guides());
        self.plan.guiding = guides.collect();
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
                let components = self.images.iter().filter_map(|images| images.of_paths(queries));
                PixelSampler::new(&self.paths, components, seed, self.plan.antithetic, terms)
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
        let of = |(c, images): (usize, &Images)| {
            (0..images.component.sources().len()).map(move |i| (c, i))
        };
        self.images.iter().enumerate().flat_map(of).collect()
    }

    /// Samples of a source to each of a pixel.
    fn source_ratio(&self, c: usize, i: usize) -> f64 {
        let budget = self.pilot.as_ref().and_then(|pilot| pilot.budget.as_ref());
        budget.map_or_else(
            || self.images[c].component.prepared.source_ratio(i),
            |budget| budget.sources[self.sources().iter().position(|s| *s == (c, i)).unwrap_or(0)],
        )
    }

    /// Samples of a batch of a source, in a pass of so many of each pixel.
    fn per_batch(&self, spp: u32, c: usize, i: usize) -> u32 {
        let per_pixel = f64::from(spp) * self.source_ratio(c, i);
        self.images[c].component.per_batch(i, per_pixel)
    }

    fn parameters(&self) -> usize {
        self.images[0].component.unknowns.parameters()
    }

    /// Terms found along paths, in the order of their layers.
    fn terms(&self) -> impl Iterator<Item = Term> {
        let terms = self.images.iter().map(|images| &images.component.prepared.terms);
        terms.flat_map(|terms| terms.along_paths(terms.queries))
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
                self.images.iter().flat_map(Images::splats),
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
        let images = self.images.iter();
        Legend {
            size: self.film.size(),
            splatted: self.plan.splatting,
            parameters: self.names(),
            along: self.terms().filter(|_| self.settings.terms).collect(),
            sources: images.flat_map(Images::terms).collect(),
            apart: self.settings.terms,
        }
    }

    fn names(&self) -> Vec<String> {
        self.images[0].component.unknowns.tangents.names.clone()
    }
}
