//! One estimator's share of a run: what it samples of which light.

mod pilot;

use alloc::vec::Vec;

use super::describe::describe;
use super::{Control, FinishedTile};
use crate::allocation;
use crate::contraction::{Contraction, Motion};
use crate::film::{BATCHES, Blocks, PixelFilm, SplatFilm};
use crate::interior::{AlongRays, Looks, PixelSampler};
use crate::kept::Kept;
use crate::medium_motion::MediumMotions;
use crate::parallel::Pool;
use crate::pixels::Filling;
use crate::plan::Plan;
use crate::prepared::Prepared;
use crate::rendering::{Account, Derivative, Layer, Term};
use crate::scene::Scene;
use crate::sensitivity::Interest;
use crate::settings::{EstimatorKind, Settings};
use crate::splatting::{Checked, ToImages};
use crate::tangents::Tangents;
use crate::transport::{Lit, World};
use crate::{Error, Estimate};
use pilot::Guidance;

/// A scene prepared for one estimator, and what has been accumulated.
pub(super) struct Part {
    prepared: Prepared,
    settings: Settings,
    motion: Option<Motion>,
    pub(super) plan: Plan,
    pixels: PixelFilm,
    splats: Vec<SplatFilm>,
    /// Which pixels and terms take more samples, once that is known.
    guidance: Option<Guidance>,
    pub(super) account: Account,
}

/// How pixels are sampled.
#[derive(Clone, Copy)]
struct Pixels {
    seed: u64,
    /// Terms go to layers of their own.
    separate: bool,
}

/// What a call to [`Part::run`] needs besides.
pub(super) struct Round<'a> {
    pub(super) pool: &'a Pool,
    pub(super) blocks: &'a Blocks,
    /// Samples per pixel.
    pub(super) spp: u32,
    /// Calls before this one.
    pub(super) passes: u32,
    pub(super) control: &'a dyn Control,
}

impl Part {
    /// Prepares a scene at the parameters' values for the light of some emitters.
    pub(super) fn new(
        scene: Scene,
        mut tangents: Tangents,
        settings: Settings,
        lit: Lit,
        kept: &mut Kept,
    ) -> Result<Self, Error> {
        for (e, emitter) in scene.emitters.iter().enumerate() {
            if !lit.by(&emitter.item.emitter) {
                tangents.emitters[e].clear();
            }
        }
        let depth = settings.max_depth.unwrap_or(scene.integrator.max_depth);
        let mut world = World::new(scene, settings.sensor, depth, None, lit, kept)?;
        let mut motion = None;
        if !tangents.names.is_empty() {
            let insides = match settings.estimator {
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
        let nothing = Interest::default();
        let interest = motion.as_ref().map_or(&nothing, |m| &m.interest);
        let flux_shapes = motion.as_ref().map_or(&[][..], |m| &m.insides.flux_shapes);
        let guide = motion.as_ref().filter(|_| settings.guiding);
        let prepared = Prepared::new(world, interest, flux_shapes, &settings, guide)?;
        let plan = describe(&prepared, motion.as_ref());
        let size = prepared.world.camera.film();
        let parameters = motion.as_ref().map_or(0, Motion::parameters);
        let layers = prepared.along_rays().layers(parameters, settings.terms);
        let films = prepared.sources.iter().map(|_| SplatFilm::new(size, parameters)).collect();
        Ok(Self {
            pixels: PixelFilm::new(size, layers),
            splats: films,
            guidance: None,
            account: Account::default(),
            settings,
            prepared,
            motion,
            plan,
        })
    }

    /// Forgets all images and takes other random numbers from now on.
    pub(super) fn restart(&mut self, seed: u64) {
        self.pixels.clear();
        self.splats.iter_mut().for_each(SplatFilm::clear);
        self.guidance = None;
        self.account = Account::default();
        self.settings.seed = seed;
    }

    /// Adds samples; returns how many each pixel took, and false when it was cancelled. `before` holds
    /// the image of the parts that ran already.
    pub(super) fn run(
        &mut self,
        round: &Round<'_>,
        before: &dyn Fn(core::ops::Range<u32>) -> Option<Vec<Estimate>>,
        last: bool,
        progress: impl Fn(f64),
    ) -> (u32, bool) {
        let per_unit = self.per_unit();
        let units = round.spp.div_ceil(per_unit);
        // The share of the work that is done when the pixels are.
        let share = if self.prepared.sources.is_empty() { 1.0 } else { 0.5 };
        let tile = |film: &PixelFilm, pixels: core::ops::Range<u32>| {
            if !last {
                return;
            }
            let mut image = film.estimates(pixels.clone());
            if let Some(before) = before(pixels.clone()) {
                for (own, other) in image.iter_mut().zip(&before) {
                    *own = own.plus(other);
                }
            }
            let pixels = (pixels.start, pixels.end);
            round.control.tile(&FinishedTile { pixels, image: &image });
        };
        let done = self.run_pixels(round, units, tile, |part| progress(share * part));
        let mut going = done == units;
        let n = self.prepared.sources.len();
        for i in 0..n {
            if going {
                going = self.run_splats(round, i, |part| {
                    progress(share + (1.0 - share) * (i as f64 + part) / n as f64);
                });
            }
        }
        (done * per_unit, going)
    }

    /// Samples every pixel `units` times more, or so on average; returns how often each was.
    fn run_pixels(
        &mut self,
        round: &Round<'_>,
        units: u32,
        tile: impl FnMut(&PixelFilm, core::ops::Range<u32>),
        progress: impl Fn(f64),
    ) -> u32 {
        let wanted = self.settings.adaptive && self.guidance.is_none();
        let pilot = allocation::pilot(units).filter(|_| wanted).unwrap_or(0);
        let begun = f64::from(pilot) / f64::from(units.max(1));
        if pilot > 0 && !self.fly_pilot(round, pilot, |part| progress(begun * part)) {
            return 0;
        }
        let mut film = core::mem::take(&mut self.pixels);
        let rest = |part| progress(begun + (1.0 - begun) * part);
        let pass = Pixels { seed: self.settings.seed, separate: self.settings.terms };
        let (account, done) = self.fill(&mut film, pass, round, units - pilot, tile, rest);
        self.account.add(account);
        self.pixels = film;
        done + pilot
    }

    /// Paths of a sample.
    fn per_unit(&self) -> u32 {
        if self.plan.antithetic { 2 } else { 1 }
    }

    /// What is found along camera rays.
    fn along_rays(&self) -> AlongRays<'_> {
        let mut along = self.prepared.along_rays();
        if let (Looks::Average(looks), Some(guidance)) = (&mut along.looks, &self.guidance) {
            *looks = guidance.split.as_ref().map_or(*looks, |split| split.looks);
        }
        along
    }

    /// Takes samples of pixels; returns how many of each were finished.
    fn fill(
        &self,
        film: &mut PixelFilm,
        pass: Pixels,
        round: &Round<'_>,
        units: u32,
        tile: impl FnMut(&PixelFilm, core::ops::Range<u32>),
        progress: impl Fn(f64),
    ) -> (Account, u32) {
        let (world, motion, along) =
            (&self.prepared.world, self.motion.as_ref(), self.along_rays());
        let Pixels { seed, separate } = pass;
        let filling = Filling {
            pool: round.pool,
            seed,
            allocation: self.guidance.as_ref().map(|g| &g.pixels),
            sampler: || {
                let sink = motion.map(|m| Contraction::new(world, m));
                PixelSampler::new(world, sink, along, seed, self.plan.antithetic, separate)
            },
        };
        let mut account = Account::default();
        let finished = |sampler: PixelSampler<'_, _>, part| {
            account.add(sampler.account());
            progress(part);
            !round.control.cancelled()
        };
        let done = filling.fill(film, units, finished, tile);
        (account, done)
    }

    /// Samples of a splatted source to each of a pixel.
    fn source_ratio(&self, i: usize) -> f64 {
        let split = self.guidance.as_ref().and_then(|guidance| guidance.split.as_ref());
        split.map_or_else(|| self.prepared.source_ratio(i), |split| split.sources[i])
    }

    /// Samples one splatted source.
    fn run_splats(&mut self, round: &Round<'_>, i: usize, progress: impl Fn(f64)) -> bool {
        let per_pixel = f64::from(round.spp) * self.source_ratio(i);
        let mut film = core::mem::take(&mut self.splats[i]);
        let seed = self.settings.seed;
        let (account, going) = self.splat(&mut film, i, seed, per_pixel, round, progress);
        self.account.add(account);
        self.splats[i] = film;
        going
    }

    /// Takes so many samples per pixel of a splatted source, in as many batches as error bars need.
    fn splat(
        &self,
        film: &mut SplatFilm,
        i: usize,
        seed: u64,
        per_pixel: f64,
        round: &Round<'_>,
        progress: impl Fn(f64),
    ) -> (Account, bool) {
        let (mut account, mut finished) = (Account::default(), 0.0);
        let Some(motion) = &self.motion else { return (account, true) };
        let source = self.prepared.sources[i];
        let per_batch = self.prepared.samples_per_batch(per_pixel);
        let splatter = self.prepared.splatter(seed);
        let mut pass = film.begin();
        let first = round.passes * BATCHES as u32;
        let going = round.pool.ordered(
            first..first + BATCHES as u32,
            1,
            |b| {
                let mut receiver = Checked::new(ToImages::new(&self.prepared.world, motion));
                let stream = source.stream() + u64::from(b);
                let account = splatter.run(source, stream, per_batch, &mut receiver);
                (receiver.inner.splats.settled(), account)
            },
            |b, (splats, of_batch)| {
                pass.add(&splats, f64::from(per_batch), round.blocks);
                account.add(of_batch);
                finished += f64::from(per_batch);
                progress(f64::from(b - first + 1) / BATCHES as f64);
                !round.control.cancelled()
            },
        );
        film.finish(&pass, finished);
        (account, going)
    }

    /// The image so far of some pixels.
    pub(super) fn estimates(&self, pixels: core::ops::Range<u32>) -> Vec<Estimate> {
        self.pixels.estimates(pixels)
    }

    /// The image so far.
    pub(super) fn image(&self, blocks: &Blocks) -> Layer {
        self.pixels.layer(0, blocks)
    }

    /// The derivatives so far.
    pub(super) fn derivatives(&self, separate: bool, blocks: &Blocks) -> Vec<Derivative> {
        let Some(motion) = &self.motion else { return Vec::new() };
        let n = motion.parameters();
        let along = self.prepared.along_rays();
        let kept_apart: Vec<Term> = along.terms().filter(|_| separate).collect();
        (0..n)
            .map(|p| {
                let mut parts = alloc::vec![(Term::Interior, self.pixels.layer(1 + p, blocks))];
                for (i, term) in kept_apart.iter().enumerate() {
                    parts.push((*term, self.pixels.layer(1 + (i + 1) * n + p, blocks)));
                }
                for (source, film) in self.prepared.sources.iter().zip(&self.splats) {
                    parts.push((source.term(), film.layer(p, blocks)));
                }
                let total = sum(parts.iter().map(|(_, l)| l)).unwrap_or_else(|| parts[0].1.clone());
                let mut terms = Vec::new();
                if separate {
                    for term in Term::ALL {
                        let own = parts.iter().filter(|(t, _)| *t == term).map(|(_, l)| l);
                        terms.extend(sum(own).map(|l| (term, l)));
                    }
                }
                Derivative { name: motion.tangents.names[p].clone(), total, terms }
            })
            .collect()
    }
}

fn sum<'a>(layers: impl Iterator<Item = &'a Layer>) -> Option<Layer> {
    layers.fold(None, |sum, l| {
        Some(match sum {
            None => l.clone(),
            Some(s) => s.plus(l),
        })
    })
}
