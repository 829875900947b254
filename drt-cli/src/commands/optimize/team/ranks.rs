//! The ranks of an MPI run.

use std::cell::Cell;
use std::ops::Range;
use std::path::Path;

use drt_estimators::fit::{Evaluation, Fit, Half};
use drt_estimators::{Shard, ShardSums};
use mpi::Threading;
use mpi::datatype::PartitionMut;
use mpi::environment::Universe;
use mpi::topology::{Color, SimpleCommunicator};
use mpi::traits::{Communicator, CommunicatorCollectives, Root};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::super::problem::Problem;
use crate::CliError;
use crate::commands::monitor::Monitor;

pub(in crate::commands::optimize) struct Ranks {
    world: SimpleCommunicator,
    /// Ends MPI when it is dropped, after the communicator.
    _universe: Universe,
    /// Shards of a half that there may be, in images and samples like those of this iteration.
    most_shards: Cell<Option<(u32, u32)>>,
}

/// What a rank has found out.
#[derive(Deserialize, Serialize)]
enum Found<T> {
    Done(T),
    /// It was told to stop.
    Stopped,
    /// With its exit code.
    Failed(u8, String),
}

/// The values that a rank is at, and the halves that it has.
type OfRank = Found<(Vec<f64>, Vec<Half>)>;

/// What a rank does of the halves of all views, which are counted through.
#[derive(Clone, Debug, PartialEq)]
enum Part {
    /// Some of them.
    Whole(Range<usize>),
    /// One shard of one.
    Shard(usize, Shard),
    /// There is nothing left for it.
    Nothing,
}

/// Ranks `a(i)` to `a(i + 1)`, of `n` in all, share the `i`-th of `m` things.
fn share(i: usize, m: usize, n: usize) -> Range<usize> {
    n * i / m..n * (i + 1) / m
}

/// What rank `r` of `n` does of so many halves, in so many shards at most.
fn part(r: usize, n: usize, halves: usize, most: u32) -> Part {
    if n <= halves {
        return Part::Whole(share(r, n, halves));
    }
    let half = (0..halves).find(|h| share(*h, halves, n).contains(&r)).unwrap_or(0);
    let team = share(half, halves, n);
    let count = u32::min(team.len() as u32, most.max(1));
    if most <= 1 {
        return if r == team.start { Part::Whole(half..half + 1) } else { Part::Nothing };
    }
    match Shard::new((r - team.start) as u32 + 1, count) {
        Some(shard) => Part::Shard(half, shard),
        None => Part::Nothing,
    }
}

impl Ranks {
    pub(super) fn join() -> Result<Self, CliError> {
        // Other threads work, but only this one talks to other ranks.
        let (universe, threading) = mpi::initialize_with_threading(Threading::Funneled)
            .ok_or_else(|| CliError::argument("MPI has been initialized before"))?;
        if threading < Threading::Funneled {
            return Err(CliError::argument("this MPI does not allow threads beside it"));
        }
        Ok(Self { world: universe.world(), _universe: universe, most_shards: Cell::new(None) })
    }

    fn rank(&self) -> usize {
        self.world.rank() as usize
    }

    fn count(&self) -> usize {
        self.world.size() as usize
    }

    pub(super) fn leads(&self) -> bool {
        self.rank() == 0
    }

    pub(super) fn agree<T>(&self, result: Result<T, CliError>) -> Result<T, CliError> {
        let own = match &result {
            Ok(_) => Found::Done(()),
            Err(e) => Found::Failed(e.exit_code(), e.to_string()),
        };
        let others = self.exchange(&own)?;
        let value = result?;
        match self.failure(others) {
            Some(error) => Err(error),
            None => Ok(value),
        }
    }

    pub(super) fn decide(&self, own: bool) -> bool {
        let mut flag = u8::from(own);
        self.world.process_at_rank(0).broadcast_into(&mut flag);
        flag != 0
    }

    pub(super) fn abort(&self, error: &CliError) -> ! {
        crate::commands::console::note(format_args!("drt: error: {error}"));
        self.world.abort(i32::from(error.exit_code()))
    }

    pub(super) fn evaluate(
        &self,
        problem: &Problem<'_>,
        i: u32,
        values: &[f64],
        fit: &mut Fit,
        monitor: &Monitor,
    ) -> Result<Option<Evaluation>, CliError> {
        let (spp, seed, halves) = (problem.spp(i), problem.seed(i), 2 * problem.views.len());
        let blame = |e: drt_estimators::Error| problem.job.blame(&e);
        let most = self.most_shards(problem, i, values, fit, halves)?;
        let part = part(self.rank(), self.count(), halves, most);
        let mut own: Vec<Half> = Vec::new();
        let mut sums = None;
        let worked = match &part {
            Part::Whole(wanted) => {
                self.whole(wanted.clone(), values, spp, seed, fit, monitor).map(|found| {
                    let done = found.is_some();
                    own = found.unwrap_or_default();
                    done
                })
            }
            Part::Shard(half, shard) => fit
                .half_shard(values, spp, seed, half / 2, half % 2, *shard, monitor)
                .map(|found| {
                    let done = found.is_some();
                    sums = found;
                    done
                }),
            Part::Nothing => Ok(true),
        };
        let worked = worked.map_err(blame);
        if self.count() > halves && most > 1 {
            let merged = self.merge(halves, worked, sums, values)?;
            return self.together(merged, values, fit, halves);
        }
        let found = match worked {
            Ok(true) => Found::Done((values.to_vec(), own)),
            Ok(false) => Found::Stopped,
            Err(e) => Found::Failed(e.exit_code(), e.to_string()),
        };
        self.together(found, values, fit, halves)
    }

    /// The halves that this rank does by itself.
    fn whole(
        &self,
        wanted: Range<usize>,
        values: &[f64],
        spp: u32,
        seed: u64,
        fit: &mut Fit,
        monitor: &Monitor,
    ) -> Result<Option<Vec<Half>>, drt_estimators::Error> {
        let mut all = Vec::new();
        let mut next = wanted.start;
        while next < wanted.end {
            let view = next / 2;
            let end = usize::min(wanted.end, 2 * view + 2);
            let own = next - 2 * view..end - 2 * view;
            match fit.halves(values, spp, seed, view, own, monitor)? {
                Some(halves) => all.extend(halves),
                None => return Ok(None),
            }
            next = end;
        }
        Ok(Some(all))
    }

    /// Shards of a half that there may be, the same on every rank.
    fn most_shards(
        &self,
        problem: &Problem<'_>,
        i: u32,
        values: &[f64],
        fit: &mut Fit,
        halves: usize,
    ) -> Result<u32, CliError> {
        if self.count() <= halves {
            return Ok(1);
        }
        let stage = problem.stage_start(i) ^ (problem.spp(i) << 16);
        if let Some((_, most)) = self.most_shards.get().filter(|(of, _)| *of == stage) {
            return Ok(most);
        }
        let found = (0..problem.views.len())
            .map(|view| fit.most_shards(values, problem.spp(i), view))
            .try_fold(u32::MAX, |least, most| most.map(|most| u32::min(least, most)));
        let most = self.agree(found.map_err(|e| problem.job.blame(&e)))?;
        self.most_shards.set(Some((stage, most)));
        Ok(most)
    }

    /// Merges the shards of every half at the first of its ranks.
    fn merge(
        &self,
        halves: usize,
        worked: Result<bool, CliError>,
        sums: Option<ShardSums>,
        values: &[f64],
    ) -> Result<OfRank, CliError> {
        let (r, n) = (self.rank(), self.count());
        let half = (0..halves).find(|h| share(*h, halves, n).contains(&r)).unwrap_or(0);
        let color = Color::with_value(half as i32);
        let Some(team) = self.world.split_by_color(color) else {
            return Err(CliError::argument("MPI gives no communicator"));
        };
        let own = match worked {
            Ok(true) => Found::Done(sums),
            Ok(false) => Found::Stopped,
            Err(e) => Found::Failed(e.exit_code(), e.to_string()),
        };
        let gathered = match gather(&team, &own) {
            Err(e) if !matches!(e, CliError::Write { .. }) => {
                return Ok(Found::Failed(e.exit_code(), e.to_string()));
            }
            gathered => gathered?,
        };
        let Some(all) = gathered else {
            return Ok(Found::Done((values.to_vec(), Vec::new())));
        };
        let mut shards = Vec::new();
        for found in all {
            match found {
                Found::Done(sums) => shards.extend(sums),
                Found::Stopped => return Ok(Found::Stopped),
                Found::Failed(code, message) => return Ok(Found::Failed(code, message)),
            }
        }
        Ok(match ShardSums::merge(&shards) {
            Ok(merged) => Found::Done((values.to_vec(), vec![Half::from(&merged.rendering)])),
            Err(e) => Found::Failed(1, e.to_string()),
        })
    }

    /// The evaluation that the halves of all ranks make, on every rank.
    fn together(
        &self,
        own: OfRank,
        values: &[f64],
        fit: &Fit,
        halves: usize,
    ) -> Result<Option<Evaluation>, CliError> {
        let all = self.exchange(&own)?;
        let mut found = Vec::new();
        let mut stopped = false;
        for (rank, of_rank) in all.into_iter().enumerate() {
            match of_rank {
                Found::Done((theirs, own)) => {
                    let same =
                        theirs.iter().map(|v| v.to_bits()).eq(values.iter().map(|v| v.to_bits()));
                    if !same {
                        return Err(CliError::unsolved(format!(
                            "rank {rank} is at other values than rank {}: every machine must see \
                             the same job, checkpoint folder and program",
                            self.rank()
                        )));
                    }
                    found.extend(own);
                }
                Found::Stopped => stopped = true,
                Found::Failed(code, message) => return Err(failed(rank, code, &message)),
            }
        }
        if stopped {
            return Ok(None);
        }
        let mut pairs = Vec::new();
        let mut found = found.into_iter();
        while let (Some(a), Some(b)) = (found.next(), found.next()) {
            pairs.push([a, b]);
        }
        debug_assert_eq!(2 * pairs.len(), halves);
        fit.together(pairs).map(Some).map_err(CliError::unsolved)
    }

    fn failure<T>(&self, all: Vec<Found<T>>) -> Option<CliError> {
        all.into_iter().enumerate().find_map(|(rank, found)| match found {
            Found::Failed(code, message) => Some(failed(rank, code, &message)),
            _ => None,
        })
    }

    /// What every rank has, in their order, on every rank.
    fn exchange<T: Serialize + DeserializeOwned>(&self, own: &T) -> Result<Vec<T>, CliError> {
        let bytes = encode(own)?;
        let n = self.count();
        let mut counts = vec![0_i32; n];
        self.world.all_gather_into(&(bytes.len() as i32), &mut counts[..]);
        let (starts, total) = starts(&counts)?;
        let mut buffer = vec![0_u8; total];
        {
            let mut parts = PartitionMut::new(&mut buffer[..], &counts[..], &starts[..]);
            self.world.all_gather_varcount_into(&bytes[..], &mut parts);
        }
        decode(&buffer, &counts)
    }
}

fn failed(rank: usize, code: u8, message: &str) -> CliError {
    let message = format!("rank {rank}: {message}");
    match code {
        1 => CliError::unsolved(message),
        _ => CliError::argument(message),
    }
}

/// What every rank of a team has, in their order, at the first one.
fn gather<T: Serialize + DeserializeOwned>(
    team: &SimpleCommunicator,
    own: &T,
) -> Result<Option<Vec<T>>, CliError> {
    let bytes = encode(own)?;
    let mut counts = vec![0_i32; team.size() as usize];
    team.all_gather_into(&(bytes.len() as i32), &mut counts[..]);
    let (starts, total) = starts(&counts)?;
    let first = team.process_at_rank(0);
    if team.rank() != 0 {
        first.gather_varcount_into(&bytes[..]);
        return Ok(None);
    }
    let mut buffer = vec![0_u8; total];
    {
        let mut parts = PartitionMut::new(&mut buffer[..], &counts[..], &starts[..]);
        first.gather_varcount_into_root(&bytes[..], &mut parts);
    }
    decode(&buffer, &counts).map(Some)
}

fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>, CliError> {
    let bytes = postcard::to_allocvec(value).map_err(CliError::unsolved)?;
    // MPI counts in 32 bits with a sign.
    match i32::try_from(bytes.len()) {
        Ok(_) => Ok(bytes),
        // The others wait for it, so this ends them as a file that cannot be written does.
        Err(_) => Err(CliError::write(Path::new("a message of MPI"), "its images are too large")),
    }
}

/// Where each message starts, and the length of all; the same on all ranks that exchange them.
fn starts(counts: &[i32]) -> Result<(Vec<i32>, usize), CliError> {
    let mut next = 0_i32;
    let mut starts = Vec::new();
    for n in counts {
        starts.push(next);
        next = next.checked_add(*n).ok_or_else(|| {
            CliError::unsolved("the images of all ranks do not fit into a message of MPI (2 GB)")
        })?;
    }
    Ok((starts, next as usize))
}

fn decode<T: DeserializeOwned>(buffer: &[u8], counts: &[i32]) -> Result<Vec<T>, CliError> {
    let mut rest = buffer;
    counts
        .iter()
        .map(|n| {
            let (own, others) = rest.split_at(*n as usize);
            rest = others;
            postcard::from_bytes(own).map_err(|e| {
                CliError::unsolved(format!("a message of another rank is damaged: {e}"))
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every half is done once, whole or in all its shards.
    #[test]
    fn ranks_share_out_everything() {
        for halves in [2, 4, 10] {
            for n in 1..40 {
                let mut done = vec![Vec::new(); halves];
                for r in 0..n {
                    match part(r, n, halves, 4) {
                        Part::Whole(some) => {
                            some.for_each(|h| done[h].push(Shard::new(1, 1).unwrap()))
                        }
                        Part::Shard(h, shard) => done[h].push(shard),
                        Part::Nothing => assert!(n > 4 * halves),
                    }
                }
                for shards in done {
                    let count = shards[0].count();
                    let expected: Vec<_> =
                        (1..=count).map(|i| Shard::new(i, count).unwrap()).collect();
                    assert_eq!(shards, expected, "{halves} {n}");
                }
            }
        }
    }
}
