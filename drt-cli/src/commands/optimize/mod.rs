//! `drt optimize`: the parameters at which a scene looks like its targets.
//!
//! A [`Problem`](problem::Problem) is the job with its targets read, a [`Descent`] the run over it. What
//! a run leaves in its folder comes in two kinds: tables and checkpoint, from which it goes on to the
//! same bits whenever it was stopped, and pictures with a report, which are made anew from them.

mod checkpoint;
mod descent;
mod fields;
mod gallery;
mod history;
mod limits;
mod problem;
mod report;
mod sources;
mod team;
mod turntable;
mod watch;

use std::path::Path;

use drt_estimators::EstimatorKind;
use drt_estimators::fit::Evaluation;
use drt_motion::optimize::Outlook;

use super::derivatives::derivatives;
use super::destinations::whole_name;
use super::monitor::Monitor;
use super::options::OptimizeOptions;
use super::outputs::Outputs;
use super::{Outcome, run};
use crate::files::atomic::check_folder;
use crate::{CliError, Job};
use descent::Descent;
use fields::Fields;
use gallery::Gallery;
use problem::Problem;
use team::Team;

pub(super) fn run(options: &OptimizeOptions) -> Result<Outcome, CliError> {
    let common = &options.common;
    if common.target_error.is_some() {
        return Err(CliError::argument(
            "--target-error: a fit ends after its iterations, or --seconds",
        ));
    }
    let team = Team::join()?;
    match together(options, &team) {
        // One of them speaks for all.
        Err(e) if !team.leads() => Ok(Outcome::Silent(e.exit_code())),
        result => result,
    }
}

fn together(options: &OptimizeOptions, team: &Team) -> Result<Outcome, CliError> {
    let common = &options.common;
    let job = team.agree(run::open_job(common))?;
    team.agree(team.check(&job))?;
    let outputs = team.agree(Outputs::of_images(common, &job, "optimize"))?;
    let problem = team.agree(Problem::new(&job, options))?;
    team.agree(spare(&problem, &outputs))?;
    let monitor = Monitor::new(common.changes.quiet || !team.leads());
    let mut descent =
        team.agree(Descent::begin(&problem, team, options.restart, common.changes.quiet))?;
    let ran = descent.run(common.seconds, &monitor);
    let (outcome, last) = ran.inspect_err(|e| {
        monitor.finish();
        team.give_up(e);
    })?;
    if !team.leads() {
        return Ok(outcome);
    }
    if outcome == Outcome::Done
        && (common.output.is_some() || common.digest.is_some() || common.preview.is_some())
    {
        write(&job, &descent, options, &outputs, &monitor)?;
    }
    monitor.finish();
    if !common.changes.quiet {
        let text = summary(&problem, &descent, last.as_ref());
        outputs.tell(&text)?;
    }
    Ok(outcome)
}

/// Refuses a checkpoint folder that cannot be written, or in which results or inputs would be overwritten.
fn spare(problem: &Problem<'_>, outputs: &Outputs) -> Result<(), CliError> {
    outputs.spare(problem.job.pictures())?;
    let Some(folder) = &problem.plan.checkpoint else { return Ok(()) };
    check_folder(folder)?;
    let folder = whole_name(folder);
    let gallery = Gallery::new(problem, &folder);
    let tables = [checkpoint::FILE, history::PARAMETERS, history::LOSSES, report::FILE];
    let is_own = |path: &Path| {
        let whole = whole_name(path);
        let name = whole.file_name().unwrap_or_default().to_string_lossy();
        whole.parent() == Some(&folder)
            && (tables.contains(&name.as_ref())
                || gallery.writes(&whole)
                || Fields::names(problem).any(|own| own == name))
    };
    let taken = problem
        .job
        .inputs()
        .chain(problem.job.pictures())
        .chain(outputs.files())
        .find(|path| is_own(path));
    taken.map_or(Ok(()), |path| {
        Err(CliError::argument(format!(
            "{} would be overwritten by the fit, whose `checkpoint` folder has a file of this name; expected \
             another folder",
            path.display()
        )))
    })
}

/// Image and derivatives at the values reached, where they were asked for.
fn write(
    job: &Job,
    descent: &Descent<'_>,
    options: &OptimizeOptions,
    outputs: &Outputs,
    monitor: &Monitor,
) -> Result<(), CliError> {
    let mut job = job.clone();
    for (parameter, value) in job.parameters.iter_mut().zip(descent.values()) {
        parameter.value = *value;
    }
    descent.fields.apply(&mut job)?;
    let by_count = super::options::Options { seconds: None, ..options.common.clone() };
    let rendering = derivatives(&job, &by_count, monitor, 1.0, &mut run::Shared::default())?;
    outputs.write(&job, &rendering, &[], &[])
}

/// The values reached, and how well they are known.
fn summary(problem: &Problem<'_>, descent: &Descent<'_>, last: Option<&Evaluation>) -> String {
    let outlook = last.and_then(|seen| descent.outlook(seen));
    let line = |(p, (name, value)): (usize, (&str, &f64))| match &outlook {
        Some(Outlook { errors, step }) => {
            let (error, further) = (errors[p], step[p]);
            let arrived = if further.abs() > error { ": not arrived" } else { "" };
            format!(
                "{name} = {value:.6} ± {error:.1e}, and a further step would change it by {further:+.1e}{arrived}\n"
            )
        }
        None => format!("{name} = {value:.6}\n"),
    };
    let mut text: String = problem.names().zip(descent.values()).enumerate().map(line).collect();
    if last.is_some() && outlook.is_none() {
        text += "± not known: the derivatives do not tell these parameters apart\n";
    }
    let names = descent.estimators();
    if problem.job.settings.estimator == EstimatorKind::Auto && !names.is_empty() {
        text += &format!("derivatives by {}, as a pilot chose\n", names.join(" and "));
    }
    if let Some([first, last]) = descent.losses() {
        text += &format!("loss {first:.3e} at the start, {last:.3e} at the end\n");
    }
    if let Some(folder) = &problem.plan.checkpoint {
        text += &format!("results and report.html are in {}\n", folder.display());
    }
    if descent.was_finished() {
        text += "it was finished before, so that nothing was left to do; --restart begins anew\n";
    }
    if descent.steps() < problem.iterations {
        let (steps, n) = (descent.steps(), problem.iterations);
        text += &match &problem.plan.checkpoint {
            Some(_) => format!("{steps} of {n} iterations; the same command goes on from here\n"),
            None => format!("{steps} of {n} iterations\n"),
        };
    }
    text
}
