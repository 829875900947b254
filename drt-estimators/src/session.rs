//! A run: a scene prepared once, sampled in passes, with its results available at any time.

use alloc::string::String;
use alloc::vec::Vec;

use drt_motion::Parameter;

use crate::boundary::Strategy;
use crate::contraction::{Contraction, Motion};
use crate::film::{BATCHES, Blocks, PixelFilm, SplatFilm};
use crate::inside::{self, Inside, Insides};
use crate::interior::PixelSampler;
use crate::parallel::Pool;
use crate::pixels::Filling;
use crate::plan::{MediumPlan, Plan};
use crate::prepared::Prepared;
use crate::rendering::{Account, Derivative, Layer, Rendering, Term};
use crate::scene::Scene;
use crate::sensitivity::Interest;
use crate::settings::{EstimatorKind, Settings};
use crate::splatting::{Checked, Source, ToImages};
use crate::tangents;
use crate::transport::World;
use crate::{Error, Estimate};

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
    account: Account,
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
            let insides = match settings.estimator {
                EstimatorKind::Radiative => Insides::at_rest(&world),
                _ => inside::plan(&world, &tangents, &settings.insides)?,
            };
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
            account: Account::default(),
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

    /// Samples every pixel `units` times more; returns how often each was.
    fn run_pixels(&mut self, units: u32, control: &dyn Control, progress: impl Fn(f64)) -> u32 {
        let (world, motion) = (&self.prepared.world, self.motion.as_ref());
        let (along, seed) = (self.prepared.along_rays(), self.settings.seed);
        let (antithetic, separate) = (self.plan.antithetic, self.settings.terms);
        let filling = Filling {
            pool: &self.pool,
            seed,
            sampler: || {
                let sink = motion.map(|m| Contraction::new(world, m));
                PixelSampler::new(world, sink, along, seed, antithetic, separate)
            },
        };
        let account = &mut self.account;
        let finished = |sampler: PixelSampler<'_, _>, part| {
            account.add(sampler.account());
            progress(part);
            !control.cancelled()
        };
        filling.fill(&mut self.pixels, units, finished, |film, pixels| {
            let image = film.estimates(pixels.clone());
            control.tile(&FinishedTile { pixels: (pixels.start, pixels.end), image: &image });
        })
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
        let (account, mut finished) = (&mut self.account, 0.0);
        let going = self.pool.ordered(
            first..first + BATCHES as u32,
            1,
            |b| {
                let mut receiver = Checked::new(ToImages::new(&self.prepared.world, motion));
                let stream = source.stream() + u64::from(b);
                let account = splatter.run(source, stream, per_batch, &mut receiver);
                (receiver.inner.splats, account)
            },
            |b, (splats, of_batch)| {
                pass.add(&splats, f64::from(per_batch), blocks);
                account.add(of_batch);
                finished += f64::from(per_batch);
                progress(f64::from(b - first + 1) / BATCHES as f64);
                !control.cancelled()
            },
        );
        self.splats[i].finish(&pass, finished);
        going
    }

    /// The images so far.
    #[must_use]
    pub fn rendering(&self) -> Rendering {
        Rendering {
            image: self.pixels.layer(0, &self.blocks),
            derivatives: self.derivatives(),
            plan: self.plan.clone(),
            counters: self.account.counters,
            non_finite: self.account.non_finite_count,
            non_finite_examples: self.account.non_finite.clone(),
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
    if prepared.flux.is_none() {
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
                let name = inside.map_or("static", Inside::name);
                let how = match (inside, insides.flux[i].contains(&p)) {
                    (None, false) => return None,
                    (_, false) => String::from(name),
                    (_, true) => alloc::format!("{name} with flux"),
                };
                Some((m.tangents.names[p].clone(), how))
            })
            .collect()
    });
    MediumPlan {
        medium: item.id.clone().unwrap_or_else(|| alloc::format!("medium[{i}]")),
        tracking: tracking.into(),
        motion: motions,
    }
}
