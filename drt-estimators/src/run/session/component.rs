//! One estimator's part of a run: what it differentiates of which light.

use alloc::string::String;
use alloc::vec::Vec;

use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::medium_motion::MediumMotions;
use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::sensitivity::TextureUse;
use crate::derivative::tangents::Tangents;
use crate::model::error::Error;
use crate::model::plan::Plan;
use crate::model::rendering::{Account, Term};
use crate::model::settings::{EstimatorKind, Settings};
use crate::run::session::describe::{describe, describe_guide};
use crate::run::session::pass::Pass;
use crate::run::session::pilot::primary_share;
use crate::sampling::film::{BATCHES, SplatFilm};
use crate::terms::guiding::{Guiding, OfImages};
use crate::terms::interior;
use crate::terms::prepared::Prepared;
use crate::terms::splatting::{Checked, ToImages};
use crate::world::World;
use crate::world::cache::PreparedCache;

/// A scene prepared for one estimator, and its boundary terms so far.
pub(super) struct Component {
    pub(super) prepared: Prepared,
    pub(super) motion: Option<Motion>,
    pub(super) plan: Plan,
    /// One film per source of boundary samples, with a layer per parameter.
    splats: Vec<SplatFilm>,
    /// What is known of each of these, where samples are guided.
    guiding: Vec<Guiding>,
    guided: bool,
}

impl Component {
    /// Prepares a world at the parameters' values for the light that it is lit by.
    pub(super) fn new(
        mut world: World,
        mut tangents: Tangents,
        settings: &Settings,
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        for (e, emitter) in world.scene.emitters.iter().enumerate() {
            if !world.lit.by(&emitter.item.emitter) {
                tangents.emitters[e].clear();
                tangents.texels.retain(|t| t.of != TextureUse::Emitter(e));
            }
        }
        let mut motion = None;
        if !tangents.names.is_empty() {
            let insides = match settings.estimator {
                EstimatorKind::Warped => MediumMotions::at_rest(world.scene.media.len()),
                EstimatorKind::Radiative => {
                    MediumMotions::affine(&world, &tangents, &settings.insides)
                }
                _ => MediumMotions::plan(&world, &tangents, &settings.insides, kept)?,
            };
            motion = Some(Motion::new(tangents, insides));
        }
        if let Some(motion) = &motion {
            world.prepare_for_derivatives(motion.needs());
        }
        let nothing = ActiveInputs::default();
        let active = motion.as_ref().map_or(&nothing, |m| &m.active);
        let flux_shapes = motion.as_ref().map_or(&[][..], |m| &m.insides.flux_shapes);
        let guide = motion.as_ref().filter(|_| settings.guiding);
        let mut prepared = Prepared::new(world, active, flux_shapes, settings, guide)?;
        // Else the pilot of a run measures more.
        let measures = !settings.adaptive || settings.boundary_ratio.is_some();
        if let Some(motion) = guide.filter(|_| measures) {
            prepared.primary_share = primary_share(&prepared, motion, prepared.boundary_ratio);
        }
        let plan = describe(&prepared, motion.as_ref());
        let parameters = motion.as_ref().map_or(0, Motion::parameters);
        let size = prepared.world.camera.film();
        let splats = prepared.sources.iter().map(|_| SplatFilm::new(size, parameters)).collect();
        let guiding = prepared.sources.iter().map(|_| Guiding::default()).collect();
        Ok(Self { prepared, motion, plan, splats, guiding, guided: settings.guiding })
    }

    /// Forgets what has been accumulated.
    pub(super) fn clear(&mut self) {
        self.splats.iter_mut().for_each(SplatFilm::clear);
        self.guiding.fill_with(Guiding::default);
    }

    /// Learns how to guide a source that takes so many samples in all, by a pilot; false when cancelled.
    pub(super) fn learn(
        &mut self,
        i: usize,
        seed: u64,
        samples: f64,
        all: &World,
        pass: &Pass<'_>,
    ) -> (Account, bool) {
        let Some(motion) = self.motion.as_ref().filter(|_| self.guided) else {
            return (Account::default(), true);
        };
        let (prepared, guiding) = (&self.prepared, &mut self.guiding[i]);
        let cancelled = || pass.control.cancelled();
        guiding.learn(
            &prepared.splatter(all, seed).until(&cancelled),
            prepared.sources[i],
            samples,
            pass.pool,
            || OfImages::new(&prepared.world, motion),
            cancelled,
        )
    }

    /// What is known of its sources that may be guided.
    pub(super) fn guiding(&self) -> impl Iterator<Item = String> {
        let guided = self.guided && self.motion.is_some();
        let sources = self.prepared.sources.iter().zip(&self.guiding);
        sources
            .filter(move |(source, _)| guided && source.is_guided())
            .map(|(source, guiding)| describe_guide(*source, guiding))
    }

    /// Its part in the derivatives of paths, if there are any; with so many edge queries to each path, where
    /// that is known better.
    pub(super) fn of_paths(
        &self,
        queries: Option<f64>,
    ) -> Option<interior::Component<'_, Contraction<'_>>> {
        let world = &self.prepared.world;
        let mut along = self.prepared.along_rays();
        along.queries = along.queries.or_average(queries);
        let sink = Contraction::new(world, self.motion.as_ref()?);
        Some(interior::Component { world, along, sink })
    }

    /// Samples of a batch of a source that takes so many per pixel where none is guided.
    pub(super) fn per_batch(&self, i: usize, per_pixel: f64) -> u32 {
        self.prepared.samples_per_batch(per_pixel * self.guiding[i].share())
    }

    /// Adds samples of one source of boundary samples, so many per pixel, in a world lit by all emitters; false when cancelled.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn run_source(
        &mut self,
        i: usize,
        seed: u64,
        per_pixel: f64,
        all: &World,
        pass: &Pass<'_>,
        progress: impl Fn(f64),
    ) -> (Account, bool) {
        let mut film = core::mem::take(&mut self.splats[i]);
        let result = self.sample_source(&mut film, i, seed, per_pixel, all, pass, progress);
        self.splats[i] = film;
        result
    }

    /// The same to a `film`, in as many batches as error bars need.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn sample_source(
        &self,
        film: &mut SplatFilm,
        i: usize,
        seed: u64,
        per_pixel: f64,
        all: &World,
        pass: &Pass<'_>,
        progress: impl Fn(f64),
    ) -> (Account, bool) {
        let (mut account, mut finished) = (Account::default(), 0.0);
        let Some(motion) = &self.motion else { return (account, true) };
        let source = self.prepared.sources[i];
        let per_batch = self.per_batch(i, per_pixel);
        let cancelled = || pass.control.cancelled();
        let splatter = self.prepared.splatter(all, seed).until(&cancelled);
        let guide = self.guiding[i].guide();
        let mut sums = film.begin();
        let first = pass.before * BATCHES as u32;
        let own = pass.shard.map_or(0..BATCHES as u32, |shard| shard.of(BATCHES as u32));
        let count = own.len() as f64;
        let going = pass.pool.ordered(
            own.clone(),
            1,
            |b| {
                let mut receiver = Checked::new(ToImages::new(&self.prepared.world, motion));
                let stream = source.stream() + u64::from(first + b);
                let account = splatter.run(source, guide, stream, per_batch, &mut receiver);
                (receiver.inner.splats.settled(), account)
            },
            |b, (splats, of_batch)| {
                account.add(of_batch);
                // A batch may have ended early.
                if pass.control.cancelled() {
                    return false;
                }
                match pass.shard {
                    None => sums.add(&splats, f64::from(per_batch), pass.blocks),
                    Some(_) => film.keep(b, splats),
                }
                finished += f64::from(per_batch);
                progress(f64::from(b - own.start + 1) / count);
                true
            },
        );
        if pass.shard.is_none() {
            film.finish(&sums, finished);
        }
        (account, going)
    }

    /// The terms that its sources of boundary samples belong to.
    pub(super) fn terms(&self) -> impl Iterator<Item = Term> {
        self.prepared.sources.iter().map(|source| source.term())
    }

    /// The films of its sources.
    pub(super) fn splats(&self) -> impl Iterator<Item = &SplatFilm> {
        self.splats.iter()
    }

    pub(super) fn splats_mut(&mut self) -> impl Iterator<Item = &mut SplatFilm> {
        self.splats.iter_mut()
    }
}
