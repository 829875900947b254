//! Running a job at doubling sample counts.

use drt_estimators::{EstimatorKind, Layer, Rendering, Session};

use super::reference::Reference;
use super::series::{Point, Series};
use crate::commands::clock::Clock;
use crate::commands::monitor::Monitor;
use crate::commands::run;
use crate::{CliError, Job};

/// What each estimator may spend.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    pub(super) seconds: f64,
    pub(super) spp: u32,
}

/// Measures the image, and where there are parameters their derivatives by paths and by differences.
pub(super) fn job(
    job: &Job,
    reference: Option<&Reference>,
    budget: Budget,
    monitor: &Monitor,
) -> Result<Vec<Series>, CliError> {
    let bench = Bench { job, reference, budget, monitor };
    let mut all =
        bench.session("forward", |job| run::prepare_forward(job, &mut run::Shared::default()))?;
    // Away from zero the parameters come along.
    all.retain(|s| s.image == IMAGE);
    if job.parameters.is_empty() || monitor.interrupted() {
        return Ok(all);
    }
    let by_paths = match job.settings.estimator {
        // Differences are measured in any case.
        EstimatorKind::FiniteDifference => EstimatorKind::PathSpace.name(),
        kind => kind.name(),
    };
    let derivatives = bench
        .session(by_paths, |job| run::prepare(job, &job.parameters, &mut run::Shared::default()))?;
    // The image comes along; it is measured by itself already.
    let derivatives = derivatives.into_iter().filter(|s| s.image != IMAGE);
    let derivatives: Vec<Series> = derivatives.collect();
    let scales: Vec<f64> = derivatives.iter().map(|s| s.scale).collect();
    all.extend(derivatives);
    if !monitor.interrupted() {
        all.extend(bench.differences(&scales)?);
    }
    Ok(all)
}

const IMAGE: &str = "image";

struct Bench<'a> {
    job: &'a Job,
    reference: Option<&'a Reference>,
    budget: Budget,
    monitor: &'a Monitor,
}

impl Bench<'_> {
    /// Doubles the samples of one session: the image and its derivatives.
    fn session(
        &self,
        estimator: &'static str,
        prepare: impl Fn(&Job) -> Result<Session, CliError>,
    ) -> Result<Vec<Series>, CliError> {
        let clock = Clock::start();
        let mut session = prepare(self.job)?;
        let set_up = clock.seconds();
        let clock = Clock::start();
        // Mirrored pairs are not torn apart.
        let mut pass = if session.plan().antithetic { 2 } else { 1 };
        let mut all: Vec<Series> = Vec::new();
        loop {
            let done = session.rendering().spp;
            self.stage(estimator, clock.seconds());
            if !session.run(pass, self.monitor) {
                break;
            }
            let (seconds, cpu_seconds) = (clock.seconds(), clock.cpu_seconds());
            let rendering = session.rendering();
            if all.is_empty() {
                all = self.open(estimator, set_up, rendering.derivatives.len());
            }
            for (i, series) in all.iter_mut().enumerate() {
                let layer = layer(&rendering, i);
                let noise = layer.relative_noise(Some(1.0));
                let error = self.error(&series.image, layer)?;
                let spp = rendering.spp;
                series.points.push(Point { spp, seconds, cpu_seconds, noise, error });
                series.scale = scale(&rendering, i);
            }
            pass += done;
            if !self.goes_on(seconds, 2 * pass) {
                break;
            }
        }
        Ok(all)
    }

    /// Finite differences, each time from the start.
    fn differences(&self, scales: &[f64]) -> Result<Vec<Series>, CliError> {
        let mut all = self.open("finite-difference", 0.0, scales.len());
        all.remove(0);
        for (series, scale) in all.iter_mut().zip(scales) {
            series.scale = *scale;
        }
        let mut spp = 1;
        loop {
            self.stage("finite-difference", 0.0);
            let clock = Clock::start();
            let step = self.job.settings.step;
            let Some(layers) = run::differences(self.job, spp, step, self.monitor)? else { break };
            let (seconds, cpu_seconds) = (clock.seconds(), clock.cpu_seconds());
            for (series, layer) in all.iter_mut().zip(&layers) {
                let noise = layer.relative_noise(Some(1.0));
                let error = self.error(&series.image, layer)?;
                series.points.push(Point { spp, seconds, cpu_seconds, noise, error });
            }
            spp *= 2;
            // Every round starts anew: the next takes as long as all so far.
            if !self.goes_on(2.0 * seconds, spp) {
                break;
            }
        }
        Ok(all)
    }

    fn stage(&self, estimator: &str, spent: f64) {
        let part = spent / self.budget.seconds;
        let name = self.job.name();
        self.monitor.stage(&format!("{name}, {estimator}"), part, 2.0 * part);
    }

    /// Whether the next doubling, up to `spp`, fits the budget.
    fn goes_on(&self, seconds: f64, spp: u32) -> bool {
        2.0 * seconds <= self.budget.seconds
            && spp <= self.budget.spp
            && !self.monitor.interrupted()
    }

    fn open(&self, estimator: &'static str, set_up: f64, derivatives: usize) -> Vec<Series> {
        let names = self.job.parameters.iter().take(derivatives).map(|p| format!("d_{}", p.name));
        std::iter::once(IMAGE.into())
            .chain(names)
            .map(|image| Series {
                job: self.job.name(),
                estimator,
                image,
                scale: 1.0,
                set_up,
                points: Vec::new(),
            })
            .collect()
    }

    fn error(&self, image: &str, layer: &Layer) -> Result<Option<f64>, CliError> {
        let name = if image == IMAGE { "" } else { image };
        self.reference.map_or(Ok(None), |r| r.error(name, layer))
    }
}

/// The image, then the derivatives.
fn layer(rendering: &Rendering, i: usize) -> &Layer {
    match i.checked_sub(1) {
        None => &rendering.image,
        Some(d) => &rendering.derivatives[d].total,
    }
}

/// What the errors of an image are relative to.
fn scale(rendering: &Rendering, i: usize) -> f64 {
    let image = layer(rendering, i);
    let (value, noise) = (image.rms_value(), image.relative_noise(Some(1.0)));
    if i == 0 || value > 2.0 * noise {
        return value;
    }
    let largest = rendering.derivatives.iter().map(|d| d.total.rms_value());
    largest.fold(value, f64::max)
}
