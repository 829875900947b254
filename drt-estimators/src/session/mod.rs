//! A run: a scene prepared once, sampled in passes, with its results available at any time.

mod describe;
mod part;

use alloc::vec::Vec;

use drt_motion::Parameter;

use part::{Part, Round};

use crate::film::Blocks;
use crate::kept::Kept;
use crate::parallel::Pool;
use crate::plan::Plan;
use crate::rendering::{Account, Rendering};
use crate::scene::{Scene, Target};
use crate::settings::{EstimatorKind, Settings};
use crate::tangents::{self, Tangents};
use crate::transport::Lit;
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

/// Between the seeds of the parts of a session, whose errors must not depend on each other.
const SEED_STEP: u64 = 0x9e37_79b9_7f4a_7c15;

fn seed_of_part(seed: u64, i: usize) -> u64 {
    seed.wrapping_add(SEED_STEP.wrapping_mul(i as u64))
}

/// A prepared scene and what has been accumulated for it.
pub struct Session {
    /// Light adds up: each looks at some of it.
    parts: Vec<Part>,
    plan: Plan,
    /// Each derivative's terms are kept apart.
    terms: bool,
    blocks: Blocks,
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
        scene.check()?;
        let (scene, tangents) = tangents::apply(scene, parameters)?;
        Self::prepared(&scene, &tangents, settings, &mut Kept::default())
    }

    /// Prepares a scene at the parameters' values, with what earlier ones left to be used again.
    pub(crate) fn prepared(
        scene: &Scene,
        tangents: &Tangents,
        settings: &Settings,
        kept: &mut Kept,
    ) -> Result<Self, Error> {
        settings.check()?;
        let tangents = tangents.seen_by(settings.sensor);
        let mut parts = Vec::new();
        for (settings, lit) in shares(scene, tangents.targets(), settings) {
            parts.push(Part::new(scene.clone(), tangents.clone(), settings, lit, kept)?);
        }
        let plan = Plan::together(parts.iter().map(|p| &p.plan));
        let size = scene.sensors[settings.sensor].item.sensor.film();
        Ok(Self {
            blocks: Blocks::new(size),
            pool: Pool::new(settings.threads),
            terms: settings.terms,
            samples: 0,
            passes: 0,
            complete: true,
            parts,
            plan,
        })
    }

    /// What will run and what is skipped.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Forgets all images, and goes on as if prepared with this seed: what comes is independent of what
    /// was.
    pub fn restart(&mut self, seed: u64) {
        for (i, part) in self.parts.iter_mut().enumerate() {
            part.restart(seed_of_part(seed, i));
        }
        (self.samples, self.passes, self.complete) = (0, 0, true);
    }

    /// Adds `spp` samples per pixel, and boundary samples in proportion. Returns false when `control`
    /// cancelled it; the result then holds what was finished.
    pub fn run(&mut self, spp: u32, control: &dyn Control) -> bool {
        let Self { pool, blocks, passes, .. } = self;
        let round = Round { pool, blocks, spp, passes: *passes, control };
        let n = self.parts.len();
        let (mut going, mut samples) = (true, 0);
        for i in 0..n {
            let (before, rest) = self.parts.split_at_mut(i);
            let image = |pixels: core::ops::Range<u32>| sum_of(before, pixels);
            let progress = |part| control.progress((i as f64 + part) / n as f64);
            if going {
                (samples, going) = rest[0].run(&round, &image, i + 1 == n, progress);
            }
        }
        self.samples += samples;
        self.passes += 1;
        self.complete &= going;
        going
    }

    /// The images so far.
    #[must_use]
    pub fn rendering(&self) -> Rendering {
        let (first, others) = self.parts.split_first().expect("a session has parts");
        let mut account = Account::default();
        account.add(first.account.clone());
        let mut image = first.image(&self.blocks);
        let mut derivatives = first.derivatives(self.terms, &self.blocks);
        for part in others {
            account.add(part.account.clone());
            image = image.plus(&part.image(&self.blocks));
            let more = part.derivatives(self.terms, &self.blocks);
            derivatives = derivatives.iter().zip(&more).map(|(a, b)| a.plus(b)).collect();
        }
        Rendering {
            image,
            derivatives,
            plan: self.plan.clone(),
            counters: account.counters,
            non_finite: account.non_finite_count,
            non_finite_examples: account.non_finite,
            spp: self.samples,
            complete: self.complete,
        }
    }
}

/// The image of several parts together, if there are any.
fn sum_of(parts: &[Part], pixels: core::ops::Range<u32>) -> Option<Vec<Estimate>> {
    let (first, others) = parts.split_first()?;
    let mut sum = first.estimates(pixels.clone());
    for part in others {
        for (s, e) in sum.iter_mut().zip(part.estimates(pixels.clone())) {
            *s = s.plus(&e);
        }
    }
    Some(sum)
}

/// Which estimator looks at which light: points and directions do not fit the 2019 form (theory sheet
/// §3), which leaves them to path space where one of the targets may move.
pub(crate) fn shares(
    scene: &Scene,
    targets: impl IntoIterator<Item = Target>,
    settings: &Settings,
) -> Vec<(Settings, Lit)> {
    let may_move = |target| match target {
        Target::Shape(_) | Target::Sensor(_) => true,
        Target::Bsdf(_) => false,
        Target::Medium(m) => scene.media.get(m).is_some_and(|m| m.item.homogeneous().is_none()),
        Target::Emitter(e) => scene.emitters.get(e).is_some_and(|e| e.item.emitter.is_delta()),
    };
    let emitters = || scene.emitters.iter().map(|e| &e.item.emitter);
    let mut shares = Vec::new();
    if settings.estimator == EstimatorKind::Radiative
        && emitters().any(|e| e.is_delta())
        && targets.into_iter().any(may_move)
    {
        shares.push((EstimatorKind::PathSpace, Lit::Delta));
        let media = scene.media.iter().any(|m| m.item.is_emissive());
        if media || emitters().any(|e| !e.is_delta()) {
            shares.push((EstimatorKind::Radiative, Lit::Extended));
        }
    } else {
        shares.push((settings.estimator, Lit::All));
    }
    // They share what is said of boundary samples; what is not, each finds out.
    let said = settings.boundary_spp.or((!settings.adaptive).then_some(settings.spp));
    let boundary_spp = said.map(|all| all.div_ceil(shares.len() as u32));
    let own = |(i, (estimator, lit)): (usize, _)| {
        let seed = seed_of_part(settings.seed, i);
        (Settings { estimator, seed, boundary_spp, ..settings.clone() }, lit)
    };
    shares.into_iter().enumerate().map(own).collect()
}
