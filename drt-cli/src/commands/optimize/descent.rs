//! The run itself: evaluate, step, store.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use drt_estimators::fit::{Evaluation, Fit};
use drt_motion::optimize::Optimizer;

use super::checkpoint::Checkpoint;
use super::history::{History, LOSSES, PARAMETERS};
use super::problem::Problem;
use crate::CliError;
use crate::atomic::write_atomically;
use crate::commands::Outcome;
use crate::commands::clock::Clock;
use crate::commands::monitor::Monitor;
use crate::commands::options::OptimizeOptions;

/// Seconds after which a checkpoint is written, however few iterations have passed.
const CHECKPOINT_SECONDS: f64 = 30.0;

/// A fit on its way.
pub(super) struct Descent<'a> {
    problem: &'a Problem<'a>,
    optimizer: Optimizer,
    history: History,
    clock: Clock,
    /// Spent before this run.
    before: [f64; 2],
    seconds: Option<f64>,
    last: Option<Evaluation>,
}

impl<'a> Descent<'a> {
    /// Begins, or goes on from the checkpoint.
    pub(super) fn begin(
        problem: &'a Problem<'a>,
        options: &OptimizeOptions,
    ) -> Result<Self, CliError> {
        let plan = problem.plan;
        let clock = Clock::start();
        let refuse = |e| CliError::input(&crate::error::Place::file(&problem.job.path), e);
        let stored = match &plan.checkpoint {
            Some(folder) if !options.restart => {
                Checkpoint::read(folder, problem.fingerprint())?.map(|c| (folder, c))
            }
            _ => None,
        };
        let seconds = options.seconds;
        let Some((folder, stored)) = stored else {
            let start = problem.start();
            let optimizer = Optimizer::new(plan.method, plan.variables.clone(), &start);
            let optimizer = optimizer.map_err(refuse)?;
            let history = History { values: vec![start], losses: Vec::new() };
            return Ok(Self {
                problem,
                optimizer,
                history,
                clock,
                before: [0.0; 2],
                seconds,
                last: None,
            });
        };
        let before = [stored.seconds, stored.cpu_seconds];
        let steps = stored.optimizer.steps as usize;
        let optimizer = Optimizer::resume(plan.method, plan.variables.clone(), stored.optimizer);
        let optimizer = optimizer.map_err(refuse)?;
        let history = History::read(folder, steps, problem.job.parameters.len())?;
        Ok(Self { problem, optimizer, history, clock, before, seconds, last: None })
    }

    /// Steps taken.
    fn steps(&self) -> u32 {
        self.optimizer.state().steps as u32
    }

    /// Goes on to the end, or until it is told to stop.
    pub(super) fn run(&mut self, monitor: &Monitor) -> Result<Outcome, CliError> {
        let problem = self.problem;
        let (mut stored, mut stored_at) = (Instant::now(), self.steps());
        let mut fit = problem.fit_at(self.steps())?;
        loop {
            let i = self.steps();
            if i > 0 && problem.plan.reduce.at(i) != problem.plan.reduce.at(i - 1) {
                fit = problem.fit_at(i)?;
            }
            let Some(evaluation) = self.evaluate(&mut fit, monitor)? else {
                self.store()?;
                return Ok(Outcome::Interrupted);
            };
            self.history.losses.push(evaluation.loss());
            if i >= problem.iterations {
                self.last = Some(evaluation);
                self.finish()?;
                return Ok(Outcome::Done);
            }
            self.step(&evaluation)?;
            let due = self.steps() - stored_at >= problem.plan.checkpoint_every
                || stored.elapsed().as_secs_f64() >= CHECKPOINT_SECONDS;
            let out_of_time = self.seconds.is_some_and(|s| self.clock.seconds() >= s);
            if due || out_of_time {
                self.store()?;
                (stored, stored_at) = (Instant::now(), self.steps());
            }
            if out_of_time {
                return Ok(Outcome::Done);
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
        let parameters = self.problem.at(self.optimizer.values());
        fit.evaluate(&parameters, self.problem.spp(i), self.problem.seed(i), monitor)
            .map_err(|e| self.problem.job.blame(&e))
    }

    fn step(&mut self, evaluation: &Evaluation) -> Result<(), CliError> {
        let factor = self.problem.plan.decay.factor(self.steps(), self.problem.iterations);
        self.optimizer
            .step(&evaluation.gradient(), factor)
            .map_err(|e| CliError::argument(format!("iteration {}: {e}", self.steps())))?;
        self.history.values.push(self.optimizer.values().to_vec());
        Ok(())
    }

    /// Writes what is needed to go on from here.
    fn store(&self) -> Result<(), CliError> {
        let Some(folder) = &self.problem.plan.checkpoint else { return Ok(()) };
        self.write_tables(folder)?;
        let [seconds, cpu_seconds] = self.spent();
        let state = self.optimizer.state().clone();
        Checkpoint::new(self.problem.fingerprint(), state, seconds, cpu_seconds).write(folder)
    }

    fn write_tables(&self, folder: &Path) -> Result<(), CliError> {
        std::fs::create_dir_all(folder).map_err(|e| CliError::write(folder, e))?;
        for (name, text) in [
            (PARAMETERS, self.history.parameters(self.problem.names())),
            (LOSSES, self.history.losses()),
        ] {
            write_atomically(&folder.join(name), |out| Ok(out.write_all(text.as_bytes())?))?;
        }
        Ok(())
    }

    fn finish(&self) -> Result<(), CliError> {
        self.store()
    }

    /// Wall and processor time of this run and those before.
    fn spent(&self) -> [f64; 2] {
        [self.before[0] + self.clock.seconds(), self.before[1] + self.clock.cpu_seconds()]
    }

    /// The values reached, and how well they are known.
    pub(super) fn summary(&self) -> String {
        let uncertainty = self.last.as_ref().and_then(Evaluation::uncertainty);
        let mut text = String::new();
        for (p, (name, value)) in self.problem.names().zip(self.optimizer.values()).enumerate() {
            // Writing to a string cannot fail.
            let _ = match &uncertainty {
                Some(u) => writeln!(text, "{name} = {value:.6} ± {:.2e}", u[p]),
                None => writeln!(text, "{name} = {value:.6}"),
            };
        }
        text
    }
}
