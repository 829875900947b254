//! Images of derivatives: an estimator's part in them, and its boundary terms so far.

use alloc::vec::Vec;

use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::sensitivity::ActiveInputs;
use crate::model::rendering::{Account, Term};
use crate::run::component::{Component, Unknowns};
use crate::run::session::pass::Pass;
use crate::sampling::film::{BATCHES, SplatFilm};
use crate::terms::guiding::OfImages;
use crate::terms::interior;
use crate::terms::splatting::{Checked, ToImages};
use crate::world::{ActiveFactors, World};

/// Parameters have an image each.
impl Unknowns for Motion {
    fn active(&self) -> &ActiveInputs {
        &self.active
    }

    fn needs(&self) -> ActiveFactors {
        self.factors()
    }

    fn flux_shapes(&self) -> &[usize] {
        &self.insides.flux_shapes
    }

    fn motion(&self) -> Option<&Motion> {
        Some(self)
    }
}

/// An estimator's part in images of derivatives.
pub(super) struct Images {
    pub(super) component: Component<Motion>,
    /// One film per source of boundary samples, with a layer per parameter.
    splats: Vec<SplatFilm>,
}

impl Images {
    /// Films for what is prepared.
    pub(super) fn new(component: Component<Motion>) -> Self {
        let Component { prepared, unknowns: motion, .. } = &component;
        let (size, parameters) = (prepared.world.camera.film(), motion.parameters());
        let splats = component.sources().iter().map(|_| SplatFilm::new(size, parameters)).collect();
        Self { component, splats }
    }

    /// Forgets what has been accumulated.
    pub(super) fn clear(&mut self) {
        self.splats.iter_mut().for_each(SplatFilm::clear);
        self.component.forget_pilots();
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
        let cancelled = || pass.control.cancelled();
        self.component.learn(i, seed, samples, all, pass.pool, OfImages::new, &cancelled)
    }

    /// Its part in the derivatives of paths, if there are any; with so many edge queries to each path, where
    /// that is known better.
    pub(super) fn of_paths(
        &self,
        queries: Option<f64>,
    ) -> Option<interior::Component<'_, Contraction<'_>>> {
        let Component { prepared, unknowns: motion, .. } = &self.component;
        if motion.parameters() == 0 {
            return None;
        }
        let mut component = prepared.component(Contraction::new(&prepared.world, motion));
        component.queries = component.queries.or_average(queries);
        Some(component)
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
        let Component { prepared, unknowns: motion, .. } = &self.component;
        let source = self.component.sources()[i];
        let per_batch = self.component.per_batch(i, per_pixel);
        let cancelled = || pass.control.cancelled();
        let splatter = prepared.splatter(all, seed).until(&cancelled);
        let guide = self.component.guiding(i).guide();
        let mut sums = film.begin();
        let first = pass.before * BATCHES as u32;
        let own = pass.shard.map_or(0..BATCHES as u32, |shard| shard.of(BATCHES as u32));
        let count = own.len() as f64;
        let going = pass.pool.ordered(
            own.clone(),
            1,
            |b| {
                let mut receiver = Checked::new(ToImages::new(&prepared.world, motion));
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
        self.component.sources().iter().map(|source| source.term())
    }

    /// The films of its sources.
    pub(super) fn splats(&self) -> impl Iterator<Item = &SplatFilm> {
        self.splats.iter()
    }

    pub(super) fn splats_mut(&mut self) -> impl Iterator<Item = &mut SplatFilm> {
        self.splats.iter_mut()
    }
}
