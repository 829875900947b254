//! A run: a scene prepared once, sampled in passes, with its results available at any time.

use alloc::string::String;
use alloc::vec::Vec;

use drt_motion::Parameter;

use crate::boundary::Strategy;
use crate::contraction::{Contraction, Motion};
use crate::film::{BATCHES, Blocks, PixelFilm, SplatFilm, Tile};
use crate::inside::{self, Inside};
use crate::interior::PixelSampler;
use crate::parallel::Pool;
use crate::plan::{MediumPlan, Plan};
use crate::prepared::Prepared;
use crate::rendering::{Counters, Derivative, Layer, NonFinite, Rendering, Term};
use crate::scene::Scene;
use crate::sensitivity::Interest;
use crate::settings::Settings;
use crate::splatting::{Account, Checked, Source, ToImages};
use crate::tangents;
use crate::transport::World;
use crate::{Error, Estimate};

/// Pixels of a tile.
const TILE: u32 = 256;
/// Samples of one piece of work.
const WORK: u32 = 1 << 12;
/// Most pieces that the samples of a round are cut into.
const CUTS: u32 = 256;
/// Samples after which a small film is looked at again.
const SLICE: u32 = 1 << 18;
/// Non-finite contributions that are described one by one.
const DESCRIBED: usize = 16;

/// Watches and steers a run. Every method has a default that does nothing.
pub trait Control: Sync {
    /// True to stop soon; what is finished is kept.
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
    /// The forward image there so far.
    pub image: &'a [Estimate],
}

/// A prepared scene and what has been accumulated for it.
pub struct Session {
    prepared: Prepared,
    motion: Option<Motion>,
    settings: Settings,
    plan: Plan,
    blocks: Blocks,
    pixels: PixelFilm,
    splats: Vec<SplatFilm>,
    counters: Counters,
    non_finite: Vec<NonFinite>,
    non_finite_count: u64,
    samples: u32,
    passes: u32,
    complete: bool,
    pool: Pool,
}

impl Session {
    /// Prepares `scene` at the parameters' values; without parameters, only the image is computed.
    ///
    /// # Errors
    /// When an effect does not fit its target, or the scene or a setting is unusable.
    pub fn new(
        scene: &Scene,
        parameters: &[Parameter],
        settings: &Settings,
    ) -> Result<Self, Error> {
        settings.check()?;
        scene.check()?;
        let (scene, tangents) = tangents::apply(scene, parameters, settings.sensor)?;
        let depth = settings.max_depth.unwrap_or(scene.integrator.max_depth);
        let mut world = World::new(scene, settings.sensor, depth, None)?;
        let mut motion = None;
        if !parameters.is_empty() {
            let insides = inside::plan(&world, &tangents, &settings.insides)?;
            motion = Some(Motion::new(tangents, insides));
        }
        if let Some(motion) = &motion {
            world.prepare_for_derivatives(motion.needs());
        }
        let nothing = Interest::default();
        let interest = motion.as_ref().map_or(&nothing, |m| &m.interest);
        let flux_shapes = motion.as_ref().map_or(&[][..], |m| &m.insides.flux_shapes);
        let prepared = Prepared::new(world, interest, flux_shapes, settings)?;
        let plan = describe(&prepared, motion.as_ref());
        let size = prepared.world.camera.film();
        let parameters = motion.as_ref().map_or(0, Motion::parameters);
        let layers = prepared.along_rays().layers(parameters, settings.terms);
        let films = prepared.sources.iter().map(|_| SplatFilm::new(size, parameters)).collect();
        Ok(Self {
            blocks: Blocks::new(size),
            pixels: PixelFilm::new(size, layers),
            splats: films,
            pool: Pool::new(settings.threads),
            settings: settings.clone(),
            counters: Counters::default(),
            non_finite: Vec::new(),
            non_finite_count: 0,
            samples: 0,
            passes: 0,
            complete: true,
            prepared,
            motion,
            plan,
        })
    }

    /// What will run and what is skipped.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Adds `spp` samples per pixel, and boundary samples in proportion. Returns false when `control`
    /// cancelled it; the result then holds what was finished.
    pub fn run(&mut self, spp: u32, control: &dyn Control) -> bool {
        let per_unit = if self.plan.antithetic { 2 } else { 1 };
        let units = spp.div_ceil(per_unit);
        // The share of the work that is done when the pixels are.
        let share = if self.prepared.sources.is_empty() { 1.0 } else { 0.5 };
        let done = self.run_pixels(units, control, |part| control.progress(share * part));
        self.samples += done * per_unit;
        let mut going = done == units;
        for i in 0..self.prepared.sources.len() {
            if going {
                let n = self.prepared.sources.len() as f64;
                going = self.run_splats(i, spp, control, |part| {
                    control.progress(share + (1.0 - share) * (i as f64 + part) / n);
                });
            }
        }
        self.passes += 1;
        self.complete &= going;
        going
    }

    /// Samples every pixel `units` times more, in rounds of which each is finished or left out: one
    /// that was cut short would leave pixels with different numbers of samples. Returns how many
    /// units were finished.
    fn run_pixels(&mut self, units: u32, control: &dyn Control, progress: impl Fn(f64)) -> u32 {
        let [w, h] = self.prepared.world.camera.film();
        let count = w * h;
        let round = (units / 16).clamp(1, u32::max(32, SLICE / count));
        let tiles = count.div_ceil(TILE);
        let parameters = self.motion.as_ref().map_or(0, Motion::parameters);
        let (along, separate) = (self.prepared.along_rays(), self.settings.terms);
        let layers = along.layers(parameters, separate);
        let first = self.pixels.units();
        let (world, motion) = (&self.prepared.world, self.motion.as_ref());
        let (settings, blocks) = (&self.settings, &self.blocks);
        let antithetic = self.plan.antithetic;
        // A film of few pixels is cut into samples as well.
        let per_work = u32::max(WORK / u32::min(count, TILE), round.div_ceil(CUTS)).max(1);
        let cuts = if tiles > CUTS { 1 } else { round.div_ceil(per_work) };
        let works = tiles * cuts;
        let rounds = units.div_ceil(round);
        let work = |i: u32| {
            let (r, t, cut) = (i / works, i / cuts % tiles, i % cuts);
            let range = t * TILE..u32::min(count, (t + 1) * TILE);
            let of = |cut: u32| {
                let within = if cut == cuts { round } else { cut * per_work };
                u32::min(units, r * round + within)
            };
            let mut tile = Tile::new(range.clone(), layers);
            let sink = motion.map(|m| Contraction::new(world, m));
            let mut sampler =
                PixelSampler::new(world, sink, along, settings.seed, antithetic, separate);
            let mut values = alloc::vec![drt_math::Rgb::ZERO; layers];
            for pixel in range {
                for unit in first + of(cut)..first + of(cut + 1) {
                    sampler.sample(pixel, unit, &mut values);
                    tile.push(blocks, pixel, unit, &values);
                }
            }
            let counters = sampler.counters();
            let account = Account {
                counters,
                non_finite: sampler.non_finite,
                non_finite_count: sampler.non_finite_count,
            };
            (tile, account)
        };
        let (mut finished, mut accounts, mut done) = (Vec::new(), Vec::new(), 0);
        let (pixels, all) = (&mut self.pixels, rounds.saturating_mul(works));
        self.pool.ordered(0..all, 4, work, |i, result| {
            finished.push(result);
            progress(f64::from(i + 1) / f64::from(all));
            if (i + 1) % works == 0 {
                let now = u32::min(units, (i + 1) / works * round);
                pixels.advance(now - done);
                done = now;
                for (tile, account) in finished.drain(..) {
                    pixels.merge(&tile);
                    accounts.push(account);
                    let image = pixels.estimates(tile.pixels.clone());
                    let pixels = (tile.pixels.start, tile.pixels.end);
                    control.tile(&FinishedTile { pixels, image: &image });
                }
            }
            !control.cancelled()
        });
        for account in accounts {
            self.account(account);
        }
        done
    }

    /// Samples one splatted source in as many batches as error bars need.
    fn run_splats(
        &mut self,
        i: usize,
        spp: u32,
        control: &dyn Control,
        progress: impl Fn(f64),
    ) -> bool {
        let Some(motion) = &self.motion else { return true };
        let source = self.prepared.sources[i];
        let per_batch = self.prepared.samples_per_batch(&self.settings, spp);
        let splatter = self.prepared.splatter(self.settings.seed);
        let mut pass = self.splats[i].begin();
        let first = self.passes * BATCHES as u32;
        let blocks = &self.blocks;
        let mut accounts = Vec::new();
        let going = self.pool.ordered(
            first..first + BATCHES as u32,
            1,
            |b| {
                let mut receiver = Checked::new(ToImages::new(&self.prepared.world, motion));
                let stream = source.stream() + u64::from(b);
                let account = splatter.run(source, stream, per_batch, &mut receiver);
                (receiver.inner.splats, account)
            },
            |b, (splats, account)| {
                pass.add(&splats, f64::from(per_batch), blocks);
                accounts.push(account);
                progress(f64::from(b - first + 1) / BATCHES as f64);
                !control.cancelled()
            },
        );
        let finished = accounts.len() as f64 * f64::from(per_batch);
        self.splats[i].finish(&pass, finished);
        for account in accounts {
            self.account(account);
        }
        going
    }

    fn account(&mut self, account: Account) {
        self.counters.add(&account.counters);
        self.non_finite_count += account.non_finite_count;
        let room = DESCRIBED.saturating_sub(self.non_finite.len());
        self.non_finite.extend(account.non_finite.into_iter().take(room));
    }

    /// The images so far.
    #[must_use]
    pub fn rendering(&self) -> Rendering {
        Rendering {
            image: self.pixels.layer(0, &self.blocks),
            derivatives: self.derivatives(),
            plan: self.plan.clone(),
            counters: self.counters,
            non_finite: self.non_finite_count,
            non_finite_examples: self.non_finite.clone(),
            spp: self.samples,
            complete: self.complete,
        }
    }

    fn derivatives(&self) -> Vec<Derivative> {
        let Some(motion) = &self.motion else { return Vec::new() };
        let n = motion.parameters();
        let along = self.prepared.along_rays();
        let kept_apart: Vec<Term> = along.terms().filter(|_| self.settings.terms).collect();
        (0..n)
            .map(|p| {
                let mut parts =
                    alloc::vec![(Term::Interior, self.pixels.layer(1 + p, &self.blocks))];
                for (i, term) in kept_apart.iter().enumerate() {
                    parts.push((*term, self.pixels.layer(1 + (i + 1) * n + p, &self.blocks)));
                }
                for (source, film) in self.prepared.sources.iter().zip(&self.splats) {
                    parts.push((source.term(), film.layer(p, &self.blocks)));
                }
                let total = sum(parts.iter().map(|(_, l)| l)).unwrap_or_else(|| parts[0].1.clone());
                let mut terms = Vec::new();
                if self.settings.terms {
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

fn describe(prepared: &Prepared, motion: Option<&Motion>) -> Plan {
    let world = &prepared.world;
    let has = |s: Source| prepared.sources.contains(&s);
    let mut plan = Plan {
        media: (0..world.scene.media.len()).map(|i| medium_plan(world, motion, i)).collect(),
        edges: prepared.boundary.count,
        primary: has(Source::Edges(Strategy::Primary)),
        direct: has(Source::Edges(Strategy::Direct)) || prepared.boundary.shadows.is_some(),
        indirect: has(Source::Edges(Strategy::Indirect)),
        borders: has(Source::Borders),
        antithetic: prepared.antithetic,
        ..Plan::default()
    };
    let mut skip = |what: &str| plan.skipped.push(String::from(what));
    if !world.has_media() {
        skip("tracking: the scene has no media");
    }
    let Some(motion) = motion else {
        skip("derivatives: there are no parameters");
        return plan;
    };
    if !motion.interest.moves_geometry() {
        skip("boundary terms: no parameter moves geometry");
    }
    if motion.insides.flux_shapes.is_empty() {
        skip("flux: every inside follows its surfaces");
    }
    plan.record = motion.interest.any();
    plan.moving_shapes = motion
        .interest
        .shapes
        .iter()
        .enumerate()
        .filter(|(_, m)| **m)
        .map(|(i, _)| world.shape_name(i))
        .collect();
    plan.flux_shapes = motion.insides.flux_shapes.iter().map(|s| world.shape_name(*s)).collect();
    plan
}

fn medium_plan(world: &World, motion: Option<&Motion>, i: usize) -> MediumPlan {
    let item = &world.scene.media[i];
    let tracking = match item.item.homogeneous() {
        Some(_) => "closed form",
        None => "delta tracking",
    };
    let motions = motion.map_or_else(Vec::new, |m| {
        let insides = &m.insides;
        (0..m.parameters())
            .filter_map(|p| {
                let inside = insides.volumes[i].iter().find(|(q, _)| *q == p).map(|(_, m)| m);
                let how = match (inside, insides.flux[i].contains(&p)) {
                    (None, false) => return None,
                    (None, true) => "static with flux",
                    (Some(Inside::Affine(_)), false) => "affine",
                    (Some(Inside::Affine(_)), true) => "affine with flux",
                    (Some(Inside::Blend(_)), false) => "blend",
                    (Some(Inside::Blend(_)), true) => "blend with flux",
                };
                Some((m.tangents.names[p].clone(), String::from(how)))
            })
            .collect()
    });
    MediumPlan {
        medium: item.id.clone().unwrap_or_else(|| alloc::format!("medium[{i}]")),
        tracking: tracking.into(),
        motion: motions,
    }
}
