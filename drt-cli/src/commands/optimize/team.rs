//! The processes that evaluate a fit together: this one alone, or the ranks of an MPI run.
//!
//! Every rank makes the same steps from the same evaluations, and only the leading one writes. A half of a view's
//! samples is evaluated by one rank, or in shards by several: either way to the same bits, so how many ranks
//! there are changes nothing.

use drt_estimators::fit::{Evaluation, Fit};

use super::problem::Problem;
use crate::commands::monitor::Monitor;
use crate::error::Place;
use crate::{CliError, Job};

#[cfg(feature = "mpi")]
mod ranks;

/// Who evaluates.
pub(super) enum Team {
    Alone,
    #[cfg(feature = "mpi")]
    Ranks(ranks::Ranks),
}

/// What launchers of MPI set to the number of processes, or to this one's.
const LAUNCHED: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMIX_RANK"];

impl Team {
    /// Joins the other ranks, where a launcher of MPI has started this one.
    pub(super) fn join() -> Result<Self, CliError> {
        if LAUNCHED.iter().all(|name| std::env::var_os(name).is_none()) {
            return Ok(Self::Alone);
        }
        #[cfg(feature = "mpi")]
        return ranks::Ranks::join().map(Self::Ranks);
        #[cfg(not(feature = "mpi"))]
        match std::env::var("OMPI_COMM_WORLD_SIZE").as_deref() {
            Ok("1") => Ok(Self::Alone),
            _ => Err(CliError::argument(
                "this drt cannot share a fit among processes: it was built without the feature \
                 `mpi` (cargo build --release -p drt-cli --features mpi)",
            )),
        }
    }

    /// Refuses what several processes cannot share.
    pub(super) fn check(&self, job: &Job) -> Result<(), CliError> {
        let few = job.optimize()?.is_some_and(|plan| plan.views_per_iteration.is_some());
        if matches!(self, Self::Alone) || (job.groups.is_empty() && !few) {
            return Ok(());
        }
        let message = "[[parameter_group]] and `views_per_iteration` go with one process; expected no launcher of MPI";
        Err(CliError::input(&Place::file(&job.path), message))
    }

    /// True for the one that writes and speaks.
    pub(super) fn leads(&self) -> bool {
        match self {
            Self::Alone => true,
            #[cfg(feature = "mpi")]
            Self::Ranks(ranks) => ranks.leads(),
        }
    }

    /// The result of something that all do; the failure of one is that of all.
    pub(super) fn agree<T>(&self, result: Result<T, CliError>) -> Result<T, CliError> {
        match self {
            Self::Alone => result,
            #[cfg(feature = "mpi")]
            Self::Ranks(ranks) => ranks.agree(result),
        }
    }

    /// What the leading one says of what each sees differently, such as time.
    pub(super) fn decide(&self, own: bool) -> bool {
        match self {
            Self::Alone => own,
            #[cfg(feature = "mpi")]
            Self::Ranks(ranks) => ranks.decide(own),
        }
    }

    /// The evaluation of iteration `i` at these values; `None` where one was told to stop.
    pub(super) fn evaluate(
        &self,
        problem: &Problem<'_>,
        i: u32,
        values: &[f64],
        fit: &mut Fit,
        monitor: &Monitor,
    ) -> Result<Option<Evaluation>, CliError> {
        match self {
            Self::Alone => fit
                .evaluate_views(
                    values,
                    problem.spp(i),
                    problem.seed(i),
                    &problem.views_at(i),
                    monitor,
                )
                .map_err(|e| problem.job.blame(&e)),
            #[cfg(feature = "mpi")]
            Self::Ranks(ranks) => ranks.evaluate(problem, i, values, fit, monitor),
        }
    }

    /// Ends the other ranks where this one alone has failed, and they wait for it.
    pub(super) fn give_up(&self, error: &CliError) {
        #[cfg(feature = "mpi")]
        if let (Self::Ranks(ranks), CliError::Write { .. }) = (self, error) {
            ranks.abort(error);
        }
        let _ = error;
    }
}
