//! What is to be fitted: the job with its targets read.

use drt_estimators::Scene;
use drt_estimators::fit::{Fit, Group, View};
use drt_math::Rng;
use drt_motion::optimize::{Method, Stages};

use crate::commands::fingerprint::Fingerprint;
use crate::commands::options::OptimizeOptions;
use crate::commands::targets;
use crate::error::Place;
use crate::job::Optimize;
use crate::{CliError, Job};

/// Random numbers that name the seeds of iterations.
const SEED_STREAM: u64 = 0x0f17;

/// Random numbers that order the views.
const VIEW_STREAM: u64 = 0x71e7;

/// A job that can be fitted.
pub(super) struct Problem<'a> {
    pub(super) job: &'a Job,
    pub(super) plan: &'a Optimize,
    /// Sensors and what they shall see, at full size.
    pub(super) views: Vec<View>,
    pub(super) iterations: u32,
    spp: Stages<u32>,
}

impl<'a> Problem<'a> {
    pub(super) fn new(job: &'a Job, options: &OptimizeOptions) -> Result<Self, CliError> {
        let place = Place::file(&job.path);
        let plan = job.optimize()?.ok_or_else(|| {
            CliError::input(&place, "it has no [optimize], which names the targets to fit to")
        })?;
        if job.parameters.is_empty() && job.groups.is_empty() {
            let message = "it has no [[parameter]] and no [[parameter_group]] to fit";
            return Err(CliError::input(&place, message));
        }
        if !job.groups.is_empty() && matches!(plan.method, Method::GaussNewton { .. }) {
            let message = "`optimizer` \"gauss-newton\" does not go with [[parameter_group]]; expected \"adam\" or \"sgd\"";
            return Err(CliError::input(&place, message));
        }
        let spp = match options.common.spp {
            Some(spp) => Stages::new(spp, Vec::new()),
            None => Stages::new(job.spp(), plan.spp.clone()),
        };
        let iterations = options.iterations.unwrap_or(plan.iterations);
        let views = targets::views(job, plan)?;
        let problem = Self { job, plan, views, iterations, spp };
        for factor in plan.reduce.values() {
            problem.fit(factor)?;
        }
        Ok(problem)
    }

    /// What an iteration evaluates.
    pub(super) fn fit_at(&self, iteration: u32) -> Result<Fit, CliError> {
        self.fit(self.plan.reduce.at(iteration))
    }

    /// The problem with its images' sides divided by `factor`.
    fn fit(&self, factor: u32) -> Result<Fit, CliError> {
        let mut scene: Scene = self.job.scene.clone();
        let mut views = Vec::new();
        for (view, target) in self.views.iter().zip(&self.plan.targets) {
            let fail = |e: &dyn std::fmt::Display| CliError::input(&Place::file(target), e);
            let reference = match factor {
                1 => view.reference.clone(),
                _ => view.reference.reduced(factor).map_err(|e| fail(&e))?,
            };
            let sensor = &mut scene.sensors[view.sensor].item;
            if factor != 1 {
                let resized = sensor.sensor.with_film(reference.size());
                sensor.sensor = resized.map_err(|e| fail(&e))?;
            }
            views.push(View { reference, ..view.clone() });
        }
        let parameters = self.job.parameters.clone();
        let groups: Vec<Group> = self.job.groups.iter().map(|g| g.group.clone()).collect();
        Group::check_together(&groups).map_err(|e| self.job.blame(&e))?;
        Fit::new(scene, parameters, views, self.plan.loss, self.job.settings.clone())
            .and_then(|fit| fit.with_groups(groups))
            .map_err(|e| self.job.blame(&e))
    }

    pub(super) fn spp(&self, iteration: u32) -> u32 {
        self.spp.at(iteration)
    }

    /// The seed of an iteration. Targets are often made with small seeds by the same program: no
    /// iteration shares its random numbers with one.
    pub(super) fn seed(&self, iteration: u32) -> u64 {
        Rng::new(self.job.settings.seed, SEED_STREAM, iteration).next_u64()
    }

    /// The views that an iteration looks at: all of them first and last, and else a few in an order that the seed fixes, each once before any comes again.
    pub(super) fn views_at(&self, iteration: u32) -> Vec<usize> {
        let count = self.views.len();
        let all = || (0..count).collect();
        let Some(few) = self.plan.views_per_iteration.map(|n| n as usize) else { return all() };
        if iteration == 0 || iteration >= self.iterations {
            return all();
        }
        let first = (iteration as usize - 1) * few;
        (first..first + few).map(|k| self.order(k / count)[k % count]).collect()
    }

    /// The order of the views in one round.
    fn order(&self, round: usize) -> Vec<usize> {
        let mut rng = Rng::new(self.job.settings.seed, VIEW_STREAM, round as u32);
        let mut keyed: Vec<(u64, usize)> =
            (0..self.views.len()).map(|v| (rng.next_u64(), v)).collect();
        keyed.sort_unstable();
        keyed.into_iter().map(|(_, v)| v).collect()
    }

    /// Columns and rows of a view's images in an iteration.
    pub(super) fn size(&self, view: usize, iteration: u32) -> [u32; 2] {
        self.views[view].reference.size().map(|n| n / self.plan.reduce.at(iteration))
    }

    /// True when steps change a parameter.
    pub(super) fn varies(&self, parameter: usize) -> bool {
        self.plan.variables[parameter].learning_rate > 0.0
    }

    /// The first iteration with images of the size of iteration `i`, without another size between.
    pub(super) fn stage_start(&self, i: u32) -> u32 {
        let reduce = |i| self.plan.reduce.at(i);
        (0..i).rev().take_while(|j| reduce(*j) == reduce(i)).last().unwrap_or(i)
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.job.parameters.iter().map(|p| p.name.as_str())
    }

    /// What the columns of the table of values hold: the parameters' values, and how far each group has gone.
    pub(super) fn columns(&self) -> impl Iterator<Item = &str> {
        self.names().chain(self.job.groups.iter().map(|g| g.group.name.as_str()))
    }

    pub(super) fn start(&self) -> Vec<f64> {
        self.job.parameters.iter().map(|p| p.value).collect()
    }

    /// Tells this problem from others, for as far as it decides the steps; how many there are is left
    /// out, so that a run can be prolonged.
    pub(super) fn fingerprint(&self) -> Result<Fingerprint, CliError> {
        let plan = self.plan;
        let settings = drt_estimators::Settings { threads: 0, ..self.job.settings.clone() };
        let mut sum = Fingerprint::default();
        serde_json::to_writer(&mut sum, &self.job.scene)
            .map_err(|e| CliError::input(&Place::file(&self.job.path), e))?;
        sum.add(format!("{:?} {settings:?}", self.job.parameters).as_bytes());
        sum.add(format!("{:?} {:?}", plan.loss, plan.method).as_bytes());
        sum.add(format!("{:?} {:?}", plan.variables, plan.decay).as_bytes());
        sum.add(format!("{:?} {:?}", self.spp, plan.reduce).as_bytes());
        sum.add(format!("{:?} {:?}", self.job.groups, plan.views_per_iteration).as_bytes());
        for view in &self.views {
            sum.add(format!("{} {:?}", view.sensor, view.reference).as_bytes());
            sum.add(format!("{:?}", view.pose).as_bytes());
        }
        Ok(sum)
    }
}
