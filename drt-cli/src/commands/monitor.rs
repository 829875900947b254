//! What watches a run: progress on a terminal, and Ctrl-C.

use std::sync::Mutex;

use drt_estimators::Control;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::stop;

/// Steps of the bar.
const RESOLUTION: f64 = 1000.0;

/// Shows progress and passes on the wish to stop.
pub(super) struct Monitor {
    bar: ProgressBar,
    place: Mutex<Place>,
}

/// Where on the bar the present work is.
struct Place {
    /// The job, where there are several.
    job: String,
    /// The part of the bar that the job fills.
    of_job: [f64; 2],
    /// The part of the bar that its current stage fills.
    stage: [f64; 2],
}

impl Monitor {
    /// The bar shows on a terminal only.
    pub(super) fn new(quiet: bool) -> Self {
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(5)
        };
        let bar = ProgressBar::with_draw_target(Some(RESOLUTION as u64), target);
        let style = "{msg} [{bar:40}] {percent} %, {elapsed} spent, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(style) {
            bar.set_style(style.progress_chars("=> "));
        }
        let whole = [0.0, 1.0];
        Self { bar, place: Mutex::new(Place { job: String::new(), of_job: whole, stage: whole }) }
    }

    /// What the next stages belong to, and the part of the bar they fill together.
    pub(super) fn job(&self, name: &str, from: f64, to: f64) {
        if let Ok(mut place) = self.place.lock() {
            (place.job, place.of_job) = (format!("{name} "), [from, to]);
        }
        self.stage("", 0.0, 1.0);
    }

    /// What the next calls work on, and the part of the bar they fill.
    pub(super) fn stage(&self, name: &str, from: f64, to: f64) {
        if let Ok(mut place) = self.place.lock() {
            let [start, end] = place.of_job;
            place.stage = [from, to].map(|x| start + (end - start) * x.clamp(0.0, 1.0));
            self.bar.set_message(format!("{}{name}", place.job));
        }
        self.progress(0.0);
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }

    pub(super) fn interrupted(&self) -> bool {
        stop::asked()
    }
}

impl Control for Monitor {
    fn cancelled(&self) -> bool {
        self.interrupted()
    }

    fn progress(&self, done: f64) {
        if let Ok(place) = self.place.lock() {
            let [from, to] = place.stage;
            self.bar.set_position(((from + (to - from) * done) * RESOLUTION) as u64);
        }
    }
}
