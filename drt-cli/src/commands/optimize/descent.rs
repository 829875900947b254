//! The run itself: evaluate, step, store.

use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use drt_estimators::fit::{Evaluation, Fit};
use drt_motion::optimize::{Method, Observation, OptimizeError, Optimizer, Outlook};

use super::checkpoint::Checkpoint;
use super::gallery::Gallery;
use super::history::{History, LOSSES, PARAMETERS};
use super::problem::Problem;
use super::report::{self, Report};
use super::team::Team;
use super::watch::Watch;
use crate::atomic::{remove_drafts, write_atomically};
use crate::commands::Outcome;
use crate::commands::clock::Clock;
use crate::commands::monitor::Monitor;
use crate::error::Place;
use crate::fingerprint::Fingerprint;
use crate::{CliError, PROGRAM};

/// Seconds after which a checkpoint is written, however few iterations have passed.
const CHECKPOINT_SECONDS: f64 = 30.0;
/// Least seconds between pictures of the present state.
const PICTURE_SECONDS: f64 = 10.0;

/// A fit on its way.
pub(super) struct Descent<'a> {
    problem: &'a Problem<'a>,
    team: &'a Team,
    fingerprint: Fingerprint,
    optimizer: Optimizer,
    history: History,
    watch: Watch<'a>,
    gallery: Option<Gallery<'a>>,
    clock: Clock,
    /// Spent before this run.
    before: [f64; 2],
    /// Nothing was left to do: what is spent on looking at it again does not count.
    again: bool,
}

impl<'a> Descent<'a> {
    /// Begins, or goes on from the checkpoint unless told to `restart`.
    pub(super) fn begin(
        problem: &'a Problem<'a>,
        team: &'a Team,
        restart: bool,
    ) -> Result<Self, CliError> {
        let (clock, plan) = (Clock::start(), problem.plan);
        let fingerprint = problem.fingerprint()?;
        let refuse = |e| CliError::input(&Place::file(&problem.job.path), e);
        let folder = plan.checkpoint.as_deref();
        let stored = match folder.filter(|_| !restart) {
            Some(folder) => Checkpoint::read(folder, fingerprint)?.map(|c| (folder, c)),
            None => None,
        };
        let count = problem.job.parameters.len();
        let (optimizer, history, blind, before, again) = match stored {
            None => {
                let start = problem.start();
                let optimizer = Optimizer::new(plan.method, plan.variables.clone(), &start);
                let history = History { values: vec![start], losses: Vec::new() };
                (optimizer, history, vec![0; count], [0.0; 2], false)
            }
            Some((folder, stored)) => {
                let history = History::read(folder, stored.optimizer.steps as usize, count)?;
                let before = [stored.seconds, stored.cpu_seconds];
                let enough = stored.optimizer.steps >= u64::from(problem.iterations);
                let again = stored.complete && enough;
                let optimizer =
                    Optimizer::resume(plan.method, plan.variables.clone(), stored.optimizer);
                (optimizer, history, stored.blind, before, again)
            }
        };
        let optimizer = optimizer.map_err(refuse)?;
        let watch = Watch::new(problem, blind);
        let folder = folder.filter(|_| team.leads());
        if let Some(folder) = folder {
            remove_drafts(folder);
        }
        let gallery = folder.map(|folder| Gallery::new(problem, folder));
        Ok(Self {
            problem,
            team,
            fingerprint,
            optimizer,
            history,
            watch,
            gallery,
            clock,
            before,
            again,
        })
    }

    /// Where it writes, if it does.
    fn folder(&self) -> Option<&Path> {
        self.problem.plan.checkpoint.as_deref().filter(|_| self.team.leads())
    }

    /// Steps taken.
    pub(super) fn steps(&self) -> u32 {
        self.optimizer.state().steps as u32
    }

    /// The values reached.
    pub(super) fn values(&self) -> &[f64] {
        self.optimizer.values()
    }

    /// Goes on to the end, or until it is told to stop, or for so many seconds. Returns what was seen
    /// last, at the values reached if that is the end.
    pub(super) fn run(
        &mut self,
        seconds: Option<f64>,
        monitor: &Monitor,
    ) -> Result<(Outcome, Option<Evaluation>), CliError> {
        let problem = self.problem;
        let (mut stored, mut stored_at, mut pictured) = (Instant::now(), self.steps(), None);
        let mut fit = problem.fit_at(self.steps())?;
        self.watch.begin(self.optimizer.values(), &mut fit)?;
        let mut last = None;
        loop {
            let i = self.steps();
            if problem.stage_start(i) == i && i > 0 {
                fit = problem.fit_at(i)?;
            }
            let Some(evaluation) = self.evaluate(&mut fit, monitor)? else {
                self.store()?;
                if let Some(seen) = &last {
                    self.picture(seen, None)?;
                }
                return Ok((Outcome::Interrupted, last));
            };
            self.look_at(i, &evaluation)?;
            if i >= problem.iterations {
                self.store()?;
                self.picture(&evaluation, None)?;
                return Ok((Outcome::Done, Some(evaluation)));
            }
            self.step(i, &evaluation, &mut fit)?;
            let out_of_time = seconds.is_some_and(|s| self.team.decide(self.clock.seconds() >= s));
            let waited = |since: Option<Instant>, s| {
                since.is_none_or(|since: Instant| since.elapsed().as_secs_f64() >= s)
            };
            if self.steps() - stored_at >= problem.plan.checkpoint_every
                || waited(Some(stored), CHECKPOINT_SECONDS)
                || out_of_time
            {
                self.store()?;
                (stored, stored_at) = (Instant::now(), self.steps());
                if waited(pictured, PICTURE_SECONDS) || out_of_time {
                    self.picture(&evaluation, None)?;
                    pictured = Some(Instant::now());
                }
            }
            last = Some(evaluation);
            if out_of_time {
                return Ok((Outcome::Done, last));
            }
        }
    }

    fn evaluate(&self, fit: &mut Fit, monitor: &Monitor) -> Result<Option<Evaluation>, CliError> {
        let (i, n) = (self.steps(), self.problem.iterations);
        let name = match self.history.losses.last() {
            Some(loss) => format!("{i} of {n}, loss {loss:.4e}"),
            None => format!("{i} of {n}"),
        };
        let part = |i: u32| f64::from(i) / f64::from(n + 1);
        monitor.stage(&name, part(i), part(i + 1));
        self.team.evaluate(self.problem, i, self.values(), fit, monitor)
    }

    /// Takes down what iteration `i` saw.
    fn look_at(&mut self, i: u32, evaluation: &Evaluation) -> Result<(), CliError> {
        self.history.losses.truncate(i as usize);
        self.history.losses.push(evaluation.loss());
        let of_stage = &self.history.losses[self.problem.stage_start(i) as usize..];
        let judged = self.watch.evaluation(i, evaluation, of_stage);
        if let (Err(error @ CliError::Unsolved(_)), true) = (&judged, i > 0) {
            self.fail(evaluation, error)?;
        }
        judged?;
        let Some(gallery) = &self.gallery else { return Ok(()) };
        if i == 0 {
            create(self.folder())?;
            gallery.clear();
            gallery.targets()?;
        }
        gallery.keep(i, evaluation)
    }

    fn step(&mut self, i: u32, evaluation: &Evaluation, fit: &mut Fit) -> Result<(), CliError> {
        let factor = self.problem.plan.decay.factor(i, self.problem.iterations);
        let before = self.optimizer.clone();
        let stepped = self
            .step_by(i, evaluation, factor)
            .map_err(|e| CliError::unsolved(format!("iteration {i}: {e}")));
        if let Err(error) = stepped.and_then(|()| self.watch.step(i, self.optimizer.values(), fit))
        {
            self.optimizer = before;
            self.fail(evaluation, &error)?;
            return Err(error);
        }
        self.history.values.push(self.optimizer.values().to_vec());
        Ok(())
    }

    fn step_by(&mut self, i: u32, seen: &Evaluation, factor: f64) -> Result<(), OptimizeError> {
        match self.problem.plan.method {
            Method::GaussNewton { .. } => {
                observe(self.problem.spp(i), seen, |seen| self.optimizer.step_by(&seen, factor))
            }
            _ => self.optimizer.step(&seen.gradient(), factor),
        }
    }

    /// How well the values are known and how far they seem to be from their goal: by all that steps
    /// follow from where that is an average, and else by what was seen last.
    pub(super) fn outlook(&self, seen: &Evaluation) -> Option<Outlook> {
        if !matches!(self.problem.plan.method, Method::GaussNewton { .. }) {
            return Some(Outlook { step: seen.newton_step()?, errors: seen.uncertainty()? });
        }
        let (i, looks) = (self.steps(), self.history.losses.len());
        if looks <= i as usize {
            return self.optimizer.outlook(None).ok().flatten();
        }
        observe(self.problem.spp(i), seen, |seen| self.optimizer.outlook(Some(&seen)))
            .ok()
            .flatten()
    }

    /// Stores how far it came before it failed.
    fn fail(&mut self, evaluation: &Evaluation, error: &CliError) -> Result<(), CliError> {
        create(self.folder())?;
        self.store()?;
        self.picture(evaluation, Some(&error.to_string()))
    }

    /// Writes what is needed to go on from here, and the tables.
    fn store(&self) -> Result<(), CliError> {
        let Some(folder) = self.folder() else { return Ok(()) };
        create(Some(folder))?;
        for (name, text) in [
            (PARAMETERS, self.history.parameters(self.problem.names())),
            (LOSSES, self.history.losses()),
        ] {
            write_atomically(&folder.join(name), |out| Ok(out.write_all(text.as_bytes())?))?;
        }
        let [seconds, cpu_seconds] = self.spent();
        let checkpoint = Checkpoint {
            program: PROGRAM.into(),
            fingerprint: self.fingerprint,
            optimizer: self.optimizer.state().clone(),
            blind: self.watch.blind.clone(),
            complete: self.history.losses.len() > self.problem.iterations as usize,
            seconds,
            cpu_seconds,
        };
        checkpoint.write(folder)
    }

    /// Shows what was seen last, and the page that tells of it.
    fn picture(&self, seen: &Evaluation, failure: Option<&str>) -> Result<(), CliError> {
        let Some((gallery, folder)) =
            self.gallery.as_ref().zip(self.problem.plan.checkpoint.as_ref())
        else {
            return Ok(());
        };
        let iteration = self.history.losses.len().saturating_sub(1) as u32;
        gallery.current(iteration, seen)?;
        let page = Report {
            problem: self.problem,
            history: &self.history,
            gallery,
            steps: self.steps(),
            outlook: self.outlook(seen),
            spent: self.spent(),
            failure,
        };
        let page = page.html();
        write_atomically(&folder.join(report::FILE), |out| Ok(out.write_all(page.as_bytes())?))
    }

    /// Wall and processor time of this run and those before, as far as they brought it on.
    fn spent(&self) -> [f64; 2] {
        if self.again {
            return self.before;
        }
        [self.before[0] + self.clock.seconds(), self.before[1] + self.clock.cpu_seconds()]
    }
}

/// Does something with what Gauss-Newton takes from an evaluation by so many samples.
fn observe<T>(spp: u32, seen: &Evaluation, then: impl FnOnce(Observation<'_>) -> T) -> T {
    then(Observation {
        gradient: &seen.gradient(),
        curvature: &seen.curvature(),
        noise: &seen.curvature_noise(),
        covariance: &seen.covariance(),
        weight: f64::from(spp),
    })
}

fn create(folder: Option<&Path>) -> Result<(), CliError> {
    let Some(folder) = folder else { return Ok(()) };
    std::fs::create_dir_all(folder).map_err(|e| CliError::write(folder, e))
}
