//! What watches a run: progress on a terminal, and Ctrl-C.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use drt_estimators::Control;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Set by the first Ctrl-C; signal handlers can reach only statics.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Steps of the bar.
const RESOLUTION: f64 = 1000.0;

/// Shows progress and passes on the wish to stop.
pub(super) struct Monitor {
    bar: ProgressBar,
    /// The part of the bar that the current stage fills.
    stage: Mutex<[f64; 2]>,
}

impl Monitor {
    /// Starts to listen for Ctrl-C: the first one stops the run, the second one the program. The bar
    /// shows on a terminal only.
    pub(super) fn new(quiet: bool) -> Self {
        // Fails when a handler is already there, as for the second command of one process.
        let _ = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
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
        Self { bar, stage: Mutex::new([0.0, 1.0]) }
    }

    /// What the next calls work on, and the part of the bar they fill.
    pub(super) fn stage(&self, name: &str, from: f64, to: f64) {
        self.bar.set_message(name.to_owned());
        if let Ok(mut stage) = self.stage.lock() {
            *stage = [from.clamp(0.0, 1.0), to.clamp(0.0, 1.0)];
        }
        self.progress(0.0);
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }

    pub(super) fn interrupted(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed)
    }
}

impl Control for Monitor {
    fn cancelled(&self) -> bool {
        self.interrupted()
    }

    fn progress(&self, done: f64) {
        if let Ok(stage) = self.stage.lock() {
            let [from, to] = *stage;
            self.bar.set_position(((from + (to - from) * done) * RESOLUTION) as u64);
        }
    }
}
