//! One estimator's part of a run: what it differentiates of which light, whatever its derivatives are taken by.

use alloc::string::String;
use alloc::vec::Vec;

use crate::derivative::contraction::Motion;
use crate::derivative::sensitivity::ActiveInputs;
use crate::estimators;
use crate::estimators::Changes;
use crate::estimators::emitter_shares::Share;
use crate::model::error::Error;
use crate::model::rendering::Account;
use crate::sampling::parallel::Pool;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::guiding::{Guiding, Sizes};
use crate::terms::level::Levels;
use crate::terms::prepared::Prepared;
use crate::world::{ActiveFactors, World};

/// What derivatives are taken by: a few parameters, each with an image, or all that a gradient has numbers for.
pub(crate) trait Unknowns {
    /// What depends on any of them.
    fn active(&self) -> &ActiveInputs;

    /// What must be sampled even where it contributes nothing to the image.
    fn needs(&self) -> ActiveFactors;

    /// Shapes beside media whose insides do not follow them.
    fn flux_shapes(&self) -> &[usize];

    /// How fast they move things, where that is known.
    fn motion(&self) -> Option<&Motion> {
        None
    }
}

/// A scene prepared for one estimator.
pub(crate) struct Component<U> {
    pub(crate) prepared: Prepared,
    pub(crate) unknowns: U,
    /// What is known of each source of boundary samples, where samples are guided.
    guiding: Vec<Guiding>,
    guided: bool,
}

/// Between the seeds of the boundary samples of components, whose errors must not depend on each other.
const SEED_STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// The seed of a component's boundary samples.
pub(crate) fn seed_of_component(seed: u64, i: usize) -> u64 {
    seed.wrapping_add(SEED_STEP.wrapping_mul(i as u64))
}

impl<U: Unknowns> Component<U> {
    /// Prepares a world that is lit by the share's light.
    pub(crate) fn new(mut world: World, unknowns: U, share: &Share) -> Result<Self, Error> {
        world.prepare_for_derivatives(unknowns.needs());
        let Share { estimator, settings, .. } = share;
        let changes = Changes {
            active: unknowns.active(),
            flux_shapes: unknowns.flux_shapes(),
            settings,
            motion: unknowns.motion().filter(|_| settings.guiding),
        };
        let prepared = estimators::prepare(*estimator, world, &changes)?;
        let guiding = prepared.terms.sources.iter().map(|_| Guiding::default()).collect();
        Ok(Self { prepared, unknowns, guiding, guided: settings.guiding })
    }

    /// Forgets what is known of where samples should go, and of what they will see.
    pub(crate) fn forget_pilots(&mut self) {
        self.guiding.fill_with(Guiding::default);
        self.prepared.levels = Levels::default();
    }

    /// Learns the levels of pixels for a run of so many samples of each, where they are not known. False when cancelled.
    pub(crate) fn learn_levels(
        &mut self,
        seed: u64,
        spp: u32,
        pool: &Pool,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> (Account, bool) {
        if !(self.prepared.levels.is_empty() && self.unknowns.active().any()) {
            return (Account::default(), true);
        }
        let Prepared { world, terms, .. } = &self.prepared;
        let (account, levels) = Levels::learn(world, terms, seed, spp, pool, cancelled);
        self.prepared.levels = levels;
        (account, !cancelled())
    }

    /// Learns how to guide a source that takes so many samples in all, by a pilot whose samples are as large as `sizes` tell, and in the
    /// light of `all` emitters where that counts. False when cancelled.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn learn<'a, S: Sizes>(
        &'a mut self,
        i: usize,
        seed: u64,
        samples: f64,
        all: &World,
        pool: &Pool,
        sizes: impl Fn(&'a World, &'a U) -> S + Sync,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> (Account, bool)
    where
        U: Sync,
    {
        if !self.guided || !self.unknowns.active().any() {
            return (Account::default(), true);
        }
        let Self { prepared, unknowns, guiding, .. } = self;
        let (prepared, unknowns) = (&*prepared, &*unknowns);
        guiding[i].learn(
            &prepared.splatter(all, seed).until(cancelled),
            prepared.terms.sources[i],
            samples,
            pool,
            || sizes(&prepared.world, unknowns),
            cancelled,
        )
    }

    /// What is sampled apart from the paths of pixels.
    pub(crate) fn sources(&self) -> &[BoundarySource] {
        &self.prepared.terms.sources
    }

    /// What is known of where a source's samples should go.
    pub(crate) fn guiding(&self, i: usize) -> &Guiding {
        &self.guiding[i]
    }

    /// What is known of its sources that may be guided, in words.
    pub(crate) fn describe_guides(&self) -> impl Iterator<Item = String> {
        let guided = self.guided && self.unknowns.active().any();
        let sources = self.sources().iter().zip(&self.guiding);
        sources
            .filter(move |(source, _)| guided && source.is_guided())
            .map(|(source, guiding)| guiding.describe(*source))
    }

    /// Samples of a batch of a source that takes so many per pixel where none is guided.
    pub(crate) fn per_batch(&self, i: usize, per_pixel: f64) -> u32 {
        self.prepared.samples_per_batch(per_pixel * self.guiding[i].share())
    }
}
