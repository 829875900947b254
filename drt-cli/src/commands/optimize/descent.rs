//! The run itself: evaluate, step, store.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use drt_estimators::EstimatorKind;
use drt_estimators::fit::{Evaluation, Fit};
use drt_motion::optimize::{Method, Observation, OptimizeError, Optimizer, Outlook};

use super::checkpoint::Checkpoint;
use super::fields::{FieldResult, Fields};
use super::gallery::Gallery;
use super::history::{History, LOSSES, PARAMETERS};
use super::limits::{self, Limits};
use super::problem::Problem;
use super::report::{self, Report};
use super::sources::Sources;
use super::team::Team;
use super::watch::Watch;
use crate::commands::Outcome;
use crate::commands::clock::Clock;
use crate::commands::fingerprint::Fingerprint;
use crate::commands::monitor::Monitor;
use crate::commands::stop;
use crate::error::Place;
use crate::files::atomic::write_atomically;
use crate::{CliError, PROGRAM};

/// Seconds after which a checkpoint is written, however few iterations have passed.
const CHECKPOINT_SECONDS: f64 = 30.0;
/// Times that a step is halved before it is given up.
const HALVINGS: u32 = 6;
/// Least seconds between pictures of the present state.
const PICTURE_SECONDS: f64 = 10.0;

/// A fit on its way.
pub(super) struct Descent<'a> {
    problem: &'a Problem<'a>,
    team: &'a Team,
    fingerprint: Fingerprint,
    sources: Sources,
    optimizer: Optimizer,
    /// The groups of unknowns.
    pub(super) fields: Fields<'a>,
    /// It only grows, so that what it was is told by two lengths.
    history: Arc<Mutex<History>>,
    /// What a signal makes of the steps that are not stored.
    kept: Option<stop::Kept>,
    watch: Watch<'a>,
    gallery: Option<Gallery<'a>>,
    clock: Clock,
    /// Spent before this run.
    before: [f64; 2],
    /// What steps were shortened by.
    limits: Limits,
    /// The estimators of derivatives at present, one for each view.
    estimators: Vec<EstimatorKind>,
    quiet: bool,
    /// Nothing was left to do: what is spent on looking at it again does not count.
    again: bool,
}

impl<'a> Descent<'a> {
    /// Begins, or goes on from the checkpoint unless told to `restart`.
    pub(super) fn begin(
        problem: &'a Problem<'a>,
        team: &'a Team,
        restart: bool,
        quiet: bool,
    ) -> Result<Self, CliError> {
        let (clock, plan) = (Clock::start(), problem.plan);
        let (fingerprint, sources) = match &plan.checkpoint {
            Some(_) => (problem.fingerprint()?, Sources::of(problem.job)?),
            None => Default::default(),
        };
        let refuse = |e| CliError::input(&Place::file(&problem.job.path), e);
        let folder = plan.checkpoint.as_deref();
        let stored = match folder.filter(|_| !restart) {
            Some(folder) => Checkpoint::read(folder, fingerprint, &sources)?.map(|c| (folder, c)),
            None => None,
        };
        let count = problem.columns().count();
        let parameters = problem.job.parameters.len();
        let (optimizer, fields, history, blind, before, again) = match stored {
            None => {
                let start = problem.start();
                let optimizer = Optimizer::new(plan.method, plan.variables.clone(), &start);
                let fields = Fields::begin(problem)?;
                let values = vec![fields.row(&start)];
                let history = History { values, losses: Vec::new() };
                (optimizer, fields, history, vec![0; parameters], [0.0; 2], false)
            }
            Some((folder, stored)) => {
                let steps = stored.optimizer.steps as usize;
                let history = History::read(folder, steps, count)?;
                history.check(folder, steps, problem.columns(), stored.tables)?;
                let before = [stored.seconds, stored.cpu_seconds];
                let enough = stored.optimizer.steps >= u64::from(problem.iterations);
                let again = stored.complete && enough;
                let optimizer =
                    Optimizer::resume(plan.method, plan.variables.clone(), stored.optimizer);
                let fields = Fields::resume(problem, stored.fields)?;
                (optimizer, fields, history, stored.blind, before, again)
            }
        };
        let optimizer = optimizer.map_err(refuse)?;
        let watch = Watch::new(problem, blind);
        let folder = folder.filter(|_| team.leads());
        let gallery = folder.map(|folder| Gallery::new(problem, folder));
        Ok(Self {
            problem,
            team,
            fingerprint,
            sources,
            optimizer,
            fields,
            history: Arc::new(Mutex::new(history)),
            kept: None,
            watch,
            gallery,
            clock,
            before,
            limits: Limits::default(),
            estimators: Vec::new(),
            quiet,
            again,
        })
    }

    /// Where it writes, if it does.
    fn folder(&self) -> Option<&Path> {
        self.problem.plan.checkpoint.as_deref().filter(|_| self.team.leads())
    }

    /// True where an earlier run took all steps.
    pub(super) fn was_finished(&self) -> bool {
        self.again
    }

    /// Steps taken.
    pub(super) fn steps(&self) -> u32 {
        self.optimizer.state().steps as u32
    }

    /// The values reached.
    pub(super) fn values(&self) -> &[f64] {
        self.optimizer.values()
    }

    /// The first loss and the last one, where there are some.
    pub(super) fn losses(&self) -> Option<[f64; 2]> {
        let history = locked(&self.history);
        Some([*history.losses.first()?, *history.losses.last()?])
    }

    /// The estimators that derivatives are by, each once.
    pub(super) fn estimators(&self) -> Vec<&'static str> {
        let mut names: Vec<_> = self.estimators.iter().map(|kind| kind.name()).collect();
        names.sort_unstable();
        names.dedup();
        names
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
        self.fields.give(&mut fit)?;
        self.watch.begin(self.optimizer.values(), &mut fit)?;
        let mut last = None;
        loop {
            let i = self.steps();
            if problem.stage_start(i) == i && i > 0 {
                fit = problem.fit_at(i)?;
                self.fields.give(&mut fit)?;
            }
            self.estimators = fit.estimators().to_vec();
            let Some(evaluation) = self.evaluate(&mut fit, monitor)? else {
                self.store()?;
                if let Some(seen) = &last {
                    self.picture(seen, false, None)?;
                }
                return Ok((Outcome::Interrupted, last));
            };
            self.look_at(i, &evaluation)?;
            if i >= problem.iterations {
                self.store()?;
                self.picture(&evaluation, false, None)?;
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
                    self.picture(&evaluation, !out_of_time, None)?;
                    pictured = Some(Instant::now());
                }
            }
            last = Some(evaluation);
            if out_of_time {
                return Ok((Outcome::Done, last));
            }
        }
    }

    fn evaluate(
        &mut self,
        fit: &mut Fit,
        monitor: &Monitor,
    ) -> Result<Option<Evaluation>, CliError> {
        let (i, n) = (self.steps(), self.problem.iterations);
        let name = match locked(&self.history).losses.last() {
            Some(loss) => format!("{i} of {n}, loss {loss:.4e}"),
            None => format!("{i} of {n}"),
        };
        let part = |i: u32| f64::from(i) / f64::from(n + 1);
        monitor.stage(&name, part(i), part(i + 1));
        // That it cannot be written is told by nobody any more.
        let rescue = |state: Snapshot| stop::rescue(move || drop(state.write()));
        self.kept = self.snapshot().map(rescue);
        self.team.evaluate(self.problem, i, self.values(), fit, monitor)
    }

    /// Takes down what iteration `i` saw.
    fn look_at(&mut self, i: u32, evaluation: &Evaluation) -> Result<(), CliError> {
        let mut history = locked(&self.history);
        history.losses.truncate(i as usize);
        history.losses.push(evaluation.loss());
        let of_stage = &history.losses[self.problem.stage_start(i) as usize..];
        let judged = self.watch.evaluation(i, evaluation, of_stage);
        drop(history);
        if let (Err(error @ CliError::Unsolved(_)), true) = (&judged, i > 0) {
            self.fail(evaluation, error)?;
        }
        judged?;
        if i == 0 {
            self.fields.check_first(evaluation)?;
        }
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
        let stepped = stepped.and_then(|()| self.stay_in_range(i, before.values(), fit));
        let stepped = stepped.and_then(|()| {
            self.step_as_far_as_possible(i, before.values(), evaluation, factor, fit)
        });
        if let Err(error) = stepped {
            self.optimizer = before;
            self.fail(evaluation, &error)?;
            return Err(error);
        }
        locked(&self.history).values.push(self.fields.row(self.optimizer.values()));
        Ok(())
    }

    /// Steps the groups as the parameters have been stepped from the values `before`, and halves both steps while the scene
    /// that they lead to is not possible.
    fn step_as_far_as_possible(
        &mut self,
        i: u32,
        before: &[f64],
        evaluation: &Evaluation,
        factor: f64,
        fit: &mut Fit,
    ) -> Result<(), CliError> {
        let fields = self.fields.clone();
        self.fields.step(i, evaluation, factor)?;
        let mut left = HALVINGS;
        loop {
            let given = self.fields.give(fit).map_err(|e| e.to_string());
            let judged = given.and_then(|()| self.watch.step(self.optimizer.values(), fit));
            let Err(reason) = judged else { return Ok(()) };
            if left == 0 {
                self.fields = fields;
                return Err(self.watch.impossible(i, self.optimizer.values(), &reason));
            }
            let aloud = self.team.leads() && !self.quiet && left == HALVINGS;
            self.limits.note_halved(i, &reason, aloud);
            self.fields.shorten(0.5);
            let halves: Vec<f64> = self
                .optimizer
                .values()
                .iter()
                .zip(before)
                .map(|(to, from)| 0.5 * (from + to))
                .collect();
            self.take_back(i, &halves)?;
            left -= 1;
        }
    }

    fn take_back(&mut self, i: u32, values: &[f64]) -> Result<(), CliError> {
        for (p, value) in values.iter().enumerate() {
            let taken = self.optimizer.take_back(p, *value);
            taken.map_err(|e| CliError::unsolved(format!("iteration {i}: {e}")))?;
        }
        Ok(())
    }

    /// Shortens a step that leads out of where properties have a meaning, parameter by parameter.
    fn stay_in_range(&mut self, i: u32, before: &[f64], fit: &mut Fit) -> Result<(), CliError> {
        let names: Vec<String> = self.problem.names().map(Into::into).collect();
        let mut wanted = self.optimizer.values().to_vec();
        // Each parameter is to blame at most once, and then all of them together.
        for round in 0..=names.len() {
            let Err(error) = fit.scene_at(&wanted) else { break };
            let named = error.out_of_range().and_then(|name| names.iter().position(|n| n == name));
            let Some(p) = named else { return Ok(()) };
            let reason = error.to_string();
            let everyone = round == names.len() || wanted[p] == before[p];
            wanted = limits::shortened(before, &wanted, (!everyone).then_some(p), |values| {
                fit.scene_at(values).is_err_and(|e| e.out_of_range().is_some())
            });
            self.take_back(i, &wanted)?;
            self.limits.note(&names[p], i, &reason, self.team.leads() && !self.quiet);
            if everyone {
                break;
            }
        }
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
        let (i, looks) = (self.steps(), locked(&self.history).losses.len());
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
        self.picture(evaluation, false, Some(&error.to_string()))
    }

    /// Writes what is needed to go on from here, and the tables.
    fn store(&mut self) -> Result<(), CliError> {
        let _writing = stop::writing();
        // It is of an earlier step, and must not overwrite what is written here.
        self.kept = None;
        self.snapshot().map_or(Ok(()), Snapshot::write)
    }

    /// What a run goes on from, ready to be written at any time. Nothing in it grows with the number of steps.
    fn snapshot(&self) -> Option<Snapshot> {
        let folder = self.folder()?.to_path_buf();
        let [seconds, cpu_seconds] = self.spent();
        let history = locked(&self.history);
        let lengths = [history.values.len(), history.losses.len()];
        let checkpoint = Checkpoint {
            program: PROGRAM.into(),
            fingerprint: self.fingerprint,
            optimizer: self.optimizer.state().clone(),
            fields: self.fields.states(),
            blind: self.watch.blind.clone(),
            complete: lengths[1] > self.problem.iterations as usize,
            seconds,
            cpu_seconds,
            sources: self.sources.clone(),
            // They are added when it is written.
            tables: Default::default(),
        };
        let names = self.problem.columns().map(Into::into).collect();
        let results = self.fields.results();
        Some(Snapshot {
            results,
            folder,
            names,
            history: self.history.clone(),
            lengths,
            checkpoint,
        })
    }

    /// Shows what was seen last, and the page that tells of it, of a run that is going on, has ended or failed.
    fn picture(
        &self,
        seen: &Evaluation,
        going: bool,
        failure: Option<&str>,
    ) -> Result<(), CliError> {
        let Some((gallery, folder)) =
            self.gallery.as_ref().zip(self.problem.plan.checkpoint.as_ref())
        else {
            return Ok(());
        };
        let _writing = stop::writing();
        let iteration = locked(&self.history).losses.len().saturating_sub(1) as u32;
        gallery.current(iteration, seen)?;
        for (group, [before, now]) in self.fields.shapes() {
            gallery.turning(group, [&before, &now])?;
        }
        let outlook = self.outlook(seen);
        let history = locked(&self.history);
        let page = Report {
            problem: self.problem,
            history: &history,
            gallery,
            steps: self.steps(),
            outlook,
            spent: self.spent(),
            going,
            failure,
            limits: &self.limits,
        };
        let page = page.html();
        drop(history);
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

/// What a run goes on from, with the tables that belong to it.
struct Snapshot {
    folder: PathBuf,
    /// The names of the columns of the table of values.
    names: Vec<String>,
    /// What the groups of unknowns have become.
    results: Vec<FieldResult>,
    history: Arc<Mutex<History>>,
    /// How many values and losses of the history belong to it.
    lengths: [usize; 2],
    /// It lacks the checksums of the tables.
    checkpoint: Checkpoint,
}

impl Snapshot {
    fn write(self) -> Result<(), CliError> {
        let Self { folder, names, results, history, lengths, mut checkpoint } = self;
        let history = locked(&history).start(lengths);
        let names = || names.iter().map(String::as_str);
        checkpoint.tables = history.sums(checkpoint.optimizer.steps as usize, names());
        create(Some(&folder))?;
        results.iter().try_for_each(|result| result.write(&folder))?;
        for (name, text) in [(PARAMETERS, history.parameters(names())), (LOSSES, history.losses())]
        {
            write_atomically(&folder.join(name), |out| Ok(out.write_all(text.as_bytes())?))?;
        }
        checkpoint.write(&folder)
    }
}

fn locked(history: &Mutex<History>) -> MutexGuard<'_, History> {
    history.lock().unwrap_or_else(PoisonError::into_inner)
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
