//! A page that tells of a run, in one file that needs nothing else.

mod chart;
mod embed;

use std::fmt::Write as _;

use chart::Chart;
use drt_motion::optimize::{Method, Outlook};
use embed::figure;

use super::gallery::Gallery;
use super::history::History;
use super::limits::Limits;
use super::problem::Problem;
use crate::PROGRAM;
use crate::commands::markup::escaped;

/// The name of the page.
pub(super) const FILE: &str = "report.html";
/// How often a browser loads the page anew while the run goes on.
const REFRESH_SECONDS: u32 = 5;
/// Most parameters with a curve and a derivative image of their own.
const MOST_SHOWN: usize = 24;

/// A run so far.
pub(super) struct Report<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) history: &'a History,
    pub(super) gallery: &'a Gallery<'a>,
    /// Steps taken.
    pub(super) steps: u32,
    /// How well the parameters are known, where derivatives tell them apart.
    pub(super) outlook: Option<Outlook>,
    /// Wall and processor time of all runs.
    pub(super) spent: [f64; 2],
    /// The run goes on, and writes the page anew.
    pub(super) going: bool,
    /// Why it ended early, where it did.
    pub(super) failure: Option<&'a str>,
    /// What steps were shortened by.
    pub(super) limits: &'a Limits,
}

impl Report<'_> {
    pub(super) fn html(&self) -> String {
        let name = escaped(&self.problem.job.name());
        let style = include_str!("style.css");
        let refresh = if self.going {
            format!("<meta http-equiv=\"refresh\" content=\"{REFRESH_SECONDS}\"/>")
        } else {
            String::new()
        };
        let mut page = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>\
             {refresh}<title>{name}: fit</title>\n<style>\n{style}</style></head><body>\n\
             <h1>{name}</h1>\n<p>{}</p>\n",
            self.summary()
        );
        if let Some(failure) = self.failure {
            page += &format!("<p class=\"failed\">{}</p>\n", escaped(failure));
        }
        for note in self.limits.notes() {
            page += &format!("<p>{}</p>\n", escaped(note));
        }
        page += &self.parameters();
        page += &self.groups();
        page += &self.curves();
        page += &self.images();
        page += &self.derivatives();
        page += &self.times();
        if let Some(text) = &self.problem.job.text {
            page += &format!(
                "<h2>Job</h2>\n<details><summary>{}</summary><pre>{}</pre></details>\n",
                escaped(&self.problem.job.path.display().to_string()),
                escaped(text)
            );
        }
        page + "</body></html>\n"
    }

    fn summary(&self) -> String {
        let (n, losses) = (self.problem.iterations, &self.history.losses);
        let loss = match (losses.first(), losses.last()) {
            (Some(first), Some(last)) => format!(", loss from {first:.4e} to {last:.4e}"),
            _ => String::new(),
        };
        format!("{} of {n} iterations{loss}. Written by {PROGRAM}.", self.steps)
    }

    fn has_parameters(&self) -> bool {
        !self.problem.job.parameters.is_empty()
    }

    fn parameters(&self) -> String {
        let mut text = String::from(
            "<h2>Parameters</h2>\n<table><tr><th>parameter</th><th>start</th><th>now</th>\
             <th>±</th><th>left</th><th>learning rate</th><th>bounds</th></tr>\n",
        );
        let rows = self.history.values.first().zip(self.history.values.last());
        let Some((start, now)) = rows.filter(|_| self.has_parameters()) else {
            return String::new();
        };
        for (p, name) in self.problem.names().enumerate() {
            let variable = &self.problem.plan.variables[p];
            let logarithmic = if variable.logarithmic { " (of the logarithm)" } else { "" };
            let bounds = match (variable.lower.is_finite(), variable.upper.is_finite()) {
                (false, false) => "none".to_owned(),
                _ => format!("{} to {}", variable.lower, variable.upper),
            };
            let known = |of: fn(&Outlook) -> &Vec<f64>| {
                let known = self.outlook.as_ref();
                known.map_or("not known".into(), |known| format!("{:.1e}", of(known)[p]))
            };
            let (error, left) = (known(|o| &o.errors), known(|o| &o.step));
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "<tr><td>{}</td><td>{:.6}</td><td>{:.6}</td><td>{error}</td><td>{left}</td>\
                 <td>{}{logarithmic}</td><td>{bounds}</td></tr>",
                escaped(name),
                start[p],
                now[p],
                variable.learning_rate
            );
        }
        let (left, error) = match self.problem.plan.method {
            Method::GaussNewton { .. } => (
                "what the next step would add, by the averages that Gauss-Newton steps follow from",
                "how far the noise of those leads astray, and the learning rate the longest step",
            ),
            _ => (
                "what a Newton step from here would add, by the last iteration's image and \
                 derivatives",
                "how far the noise of that iteration alone would lead it astray; a fit averages \
                 over many",
            ),
        };
        format!(
            "{text}</table>\n<p><b>left</b> is {left}. <b>±</b> is {error}. Both are unknown where \
             derivatives do not tell parameters apart.</p>\n"
        )
    }

    /// How many unknowns each group has, and how far they have gone.
    fn groups(&self) -> String {
        let job = self.problem.job;
        let Some(now) = self.history.values.last().filter(|_| !job.groups.is_empty()) else {
            return String::new();
        };
        let mut text = String::from(
            "<h2>Groups</h2>\n<table><tr><th>group</th><th>values</th><th>shape</th>\
             <th>root mean square change</th></tr>\n",
        );
        for (group, change) in job.groups.iter().zip(&now[job.parameters.len()..]) {
            let shape = group.group.shape(&job.scene);
            let count: usize = shape.iter().product();
            let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "<tr><td>{}</td><td>{count}</td><td>{}</td><td>{change:.4e}</td></tr>",
                escaped(&group.group.name),
                shape.join(" × ")
            );
        }
        text + "</table>\n"
    }

    fn curves(&self) -> String {
        let loss =
            Chart { title: "loss", values: &self.history.losses, logarithmic: true, error: None };
        let mut text = format!("<h2>Curves</h2>\n<div class=\"row\">\n{}", loss.svg());
        let parameters = self.problem.job.parameters.len();
        let shown = |p: &usize| *p < usize::min(parameters, MOST_SHOWN) || *p >= parameters;
        for (p, name) in self.problem.columns().enumerate().filter(|(p, _)| shown(p)) {
            let values: Vec<f64> = self.history.values.iter().map(|row| row[p]).collect();
            let error = self.outlook.as_ref().and_then(|known| known.errors.get(p).copied());
            let title = if p < parameters { name } else { &format!("{name}: change") };
            text += &Chart { title, values: &values, logarithmic: false, error }.svg();
        }
        let bars = if self.has_parameters() { "; the red bar is ±" } else { "" };
        format!("{text}</div>\n<p>Over iterations{bars}.</p>\n")
    }

    fn images(&self) -> String {
        let mut text = String::from("<h2>Images</h2>\n");
        for v in 0..self.problem.views.len() {
            text += "<div class=\"row\">\n";
            for i in self.gallery.frames().filter(|i| *i <= self.steps) {
                text += &figure(&self.gallery.frame(v, i), &format!("iteration {i}"));
            }
            if !self.gallery.frames().any(|i| i == self.steps) {
                let now = format!("now, iteration {}", self.steps);
                text += &figure(&self.gallery.file(v, "current"), &now);
            }
            text += &figure(&self.gallery.file(v, "target"), "target");
            text += &figure(&self.gallery.file(v, "difference"), "now − target");
            text += "</div>\n";
        }
        for group in &self.problem.job.groups {
            let name = &group.group.name;
            text +=
                &figure(&self.gallery.shape(name), &format!("{name}: the start above, now below"));
        }
        text
    }

    fn derivatives(&self) -> String {
        if !self.has_parameters() {
            return String::new();
        }
        let mut text = String::from("<h2>Derivatives</h2>\n");
        for v in 0..self.problem.views.len() {
            text += "<div class=\"row\">\n";
            for (p, name) in self.problem.names().enumerate().take(MOST_SHOWN) {
                text += &figure(&self.gallery.derivative(v, p), name);
            }
            text += "</div>\n";
        }
        text + "<p>Blue is negative, red positive, each picture in its own range.</p>\n"
    }

    fn times(&self) -> String {
        let [seconds, cpu_seconds] = self.spent;
        let evaluations = self.history.losses.len().max(1) as f64;
        format!(
            "<h2>Times</h2>\n<table><tr><th></th><th>all</th><th>per iteration</th></tr>\n\
             <tr><td>wall time</td><td>{seconds:.1} s</td><td>{:.3} s</td></tr>\n\
             <tr><td>processor time</td><td>{cpu_seconds:.1} s</td><td>{:.3} s</td></tr></table>\n",
            seconds / evaluations,
            cpu_seconds / evaluations
        )
    }
}
