//! Runs in parts, on as many machines, and how the parts become one again.
//!
//! A run adds its samples up in at most 32 strata, and these in order. A shard has some of the strata, whole, and
//! keeps their sums apart; so merging repeats the additions of the run in one piece, and gives its bits.

use alloc::sync::Arc;
use alloc::vec::Vec;

use thiserror::Error;

use crate::model::error::{Error as RunError, SettingError};
use crate::model::plan::Plan;
use crate::model::rendering::{Account, Rendering};
use crate::model::shard::Shard;
use crate::run::control::Control;
use crate::run::session::Session;
use crate::run::session::images::Images;
use crate::run::session::legend::Legend;
use crate::run::session::pass::Pass;
use crate::sampling::film::{BATCHES, Blocks, PixelFilm, SplatFilm, Splats, Stratum};
use crate::sampling::{allocation, pixels};

/// What one shard of a run has added up.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ShardSums {
    shard: Shard,
    run: Run,
    strata: Vec<(u32, Stratum)>,
    /// Per source of boundary samples.
    sources: Vec<Vec<(u32, Splats)>>,
    plan: Plan,
    account: Account,
}

/// What all shards of a run have in common.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Run {
    legend: Legend,
    seed: u64,
    /// Samples of each pixel.
    spp: u32,
    /// Of these, in how many units, the pilot's left out.
    units: u32,
    /// Pixels take different numbers of samples.
    adaptive: bool,
    /// Samples of a batch of each source.
    per_batch: Vec<u32>,
}

/// Why shards do not make a run.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ShardError {
    /// There are none.
    #[error("there are no shards to merge")]
    None,
    /// One of another run: scene, settings, seed or number of samples differ.
    #[error("shard {0} belongs to another run")]
    Foreign(Shard),
    /// One that is there already.
    #[error("shard {0} is there twice")]
    Twice(Shard),
    /// Sums that cannot be those of a shard.
    #[error("shard {0} is damaged: {1}")]
    Damaged(Shard, &'static str),
    /// Some are missing where all are needed.
    #[error(
        "the shards {0:?} are missing; where pixels take different numbers of samples, all are needed"
    )]
    Missing(Vec<u32>),
    /// Too few to tell an error.
    #[error("a single batch of samples has no error; merge more shards")]
    TooFew,
}

/// A run from its shards.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Merged {
    /// The images. Where shards are missing they are marked as not complete, but they are unbiased, with the errors of
    /// the samples that were taken.
    pub rendering: Rendering,
    /// The shards that are missing.
    pub missing: Vec<u32>,
}

impl Session {
    /// The most shards that a run of so many samples per pixel has.
    #[must_use]
    pub fn most_shards(&self, spp: u32) -> u32 {
        let all = spp.div_ceil(self.per_unit());
        let pilot = allocation::pilot(all).filter(|_| self.settings.adaptive).unwrap_or(0);
        let pass = pixels::Pass::new(0, all - pilot, self.film.size());
        u32::min(pass.parts(), BATCHES as u32)
    }

    /// Takes one shard of the samples that [`run`](Self::run) takes after [`restart`](Self::restart) with `seed`, after
    /// discarding all earlier samples. `None` when `control` cancelled it. Where the settings are
    /// [adaptive](crate::Settings::adaptive), every shard takes equal pilot samples, so that all make equal decisions.
    ///
    /// # Errors
    /// When there are more shards than strata of samples.
    pub fn run_shard(
        &mut self,
        spp: u32,
        seed: u64,
        shard: Shard,
        control: &dyn Control,
    ) -> Result<Option<ShardSums>, RunError> {
        self.restart(seed);
        let (pool, blocks) = (Arc::clone(&self.pool), Arc::clone(&self.blocks));
        let all = spp.div_ceil(self.per_unit());
        let pilot = self.pilot_units(all);
        let most = self.most_shards(spp);
        if shard.count() > most {
            let reason = SettingError::TooManyShards { count: shard.count(), most };
            return Err(RunError::Setting { setting: "shard", reason });
        }
        let pass =
            Pass { pool: &pool, blocks: &blocks, spp, before: 0, shard: Some(shard), control };
        let (_, going) = self.run_pass(&pass);
        if !going {
            return Ok(None);
        }
        let per_batch =
            self.sources().into_iter().map(|(c, i)| self.per_batch(spp, c, i)).collect();
        let run = Run {
            legend: self.legend(),
            seed,
            spp: all * self.per_unit(),
            units: all - pilot,
            adaptive: self.pilot.is_some(),
            per_batch,
        };
        let films = self.images.iter_mut().flat_map(Images::splats_mut);
        Ok(Some(ShardSums {
            shard,
            run,
            sources: films.map(SplatFilm::take_kept).collect(),
            strata: self.film.take_kept(),
            plan: self.plan.clone(),
            account: core::mem::take(&mut self.account),
        }))
    }
}

impl ShardSums {
    /// Which shard it is.
    #[must_use]
    pub fn shard(&self) -> Shard {
        self.shard
    }

    /// The strata and batches that must be here, and nothing else.
    fn check(&self) -> Result<(), ShardError> {
        let damaged = |what| Err(ShardError::Damaged(self.shard, what));
        let Run { legend, units, per_batch, .. } = &self.run;
        if Shard::new(self.shard.index(), self.shard.count()).is_none() {
            return damaged("its number");
        }
        let pass = pixels::Pass::new(0, *units, legend.size);
        if self.shard.count() > pass.parts() {
            return damaged("the number of its samples");
        }
        let own = pass.strata(Some(self.shard)).map(|part| part.number);
        if !own.eq(self.strata.iter().map(|(n, _)| *n)) {
            return damaged("the numbers of its strata");
        }
        if !self.strata.iter().all(|(_, s)| s.is_of(legend.size, legend.layers(), legend.splatted))
        {
            return damaged("the size of its strata");
        }
        let sources = legend.sources.len();
        if self.sources.len() != sources || per_batch.len() != sources {
            return damaged("the number of its sources");
        }
        let batches = self.shard.of(BATCHES as u32);
        for source in &self.sources {
            if !batches.clone().eq(source.iter().map(|(b, _)| *b)) {
                return damaged("the numbers of its batches");
            }
            if !source.iter().all(|(_, s)| s.is_of(legend.size, legend.parameters.len())) {
                return damaged("the size of its batches");
            }
        }
        Ok(())
    }

    /// The result of the run to which the shards belong, in whatever order they are given. With all shards it has the
    /// bits of the run in one piece.
    ///
    /// # Errors
    /// When the shards do not belong to one run, a shard is given twice or damaged, or too many are missing.
    pub fn merge(shards: &[Self]) -> Result<Merged, ShardError> {
        let mut shards: Vec<&Self> = shards.iter().collect();
        shards.sort_by_key(|s| s.shard.index());
        let Some(first) = shards.first() else { return Err(ShardError::None) };
        for (i, s) in shards.iter().enumerate() {
            if s.run != first.run || s.shard.count() != first.shard.count() {
                return Err(ShardError::Foreign(s.shard));
            }
            if i > 0 && shards[i - 1].shard == s.shard {
                return Err(ShardError::Twice(s.shard));
            }
            s.check()?;
        }
        let there = |i: &u32| shards.iter().any(|s| s.shard.index() == *i);
        let missing: Vec<u32> = (1..=first.shard.count()).filter(|i| !there(i)).collect();
        if !missing.is_empty() && first.run.adaptive {
            return Err(ShardError::Missing(missing));
        }
        let rendering = Self::together(&shards, missing.is_empty())?;
        Ok(Merged { rendering, missing })
    }

    fn together(shards: &[&Self], complete: bool) -> Result<Rendering, ShardError> {
        let run = &shards[0].run;
        let (legend, size) = (&run.legend, run.legend.size);
        let blocks = Blocks::new(size);
        let pass = pixels::Pass::new(0, run.units, size);
        let mut film = PixelFilm::of_strata(size, legend.layers(), legend.splatted);
        film.begin();
        let strata = || shards.iter().flat_map(|s| &s.strata);
        for part in pass.strata(None) {
            if let Some((_, stratum)) = strata().find(|(number, _)| *number == part.number) {
                film.put_back(stratum, part.units[1] - part.units[0]);
            }
            if part.ends_run() {
                film.end_run();
            }
        }
        let mut splats = Vec::new();
        for (i, per_batch) in run.per_batch.iter().enumerate() {
            let mut splat = SplatFilm::new(size, legend.parameters.len());
            let (mut sums, mut samples, mut count) = (splat.begin(), 0.0, 0);
            for (_, batch) in shards.iter().flat_map(|s| &s.sources[i]) {
                sums.add(batch, f64::from(*per_batch), &blocks);
                samples += f64::from(*per_batch);
                count += 1;
            }
            if count < 2 {
                return Err(ShardError::TooFew);
            }
            splat.finish(&sums, samples);
            splats.push(splat);
        }
        let mut account = Account::default();
        shards.iter().for_each(|s| account.add(s.account.clone()));
        let part = f64::from(film.units()) / f64::from(run.units.max(1));
        Ok(Rendering {
            image: film.layer(0, &blocks),
            derivatives: legend.derivatives(&film, splats.iter(), &blocks),
            plan: shards[0].plan.clone(),
            counters: account.counters,
            non_finite: account.non_finite_count,
            non_finite_examples: account.non_finite,
            spp: (f64::from(run.spp) * part) as u32,
            complete,
        })
    }
}
