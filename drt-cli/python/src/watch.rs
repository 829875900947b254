//! What watches a call from Python: its progress, and Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

use drt_estimators::Control;
use pyo3::prelude::*;

/// Between two times that the interpreter is asked, for which its lock must be taken.
const PATIENCE: Duration = Duration::from_millis(50);

/// Calls back into Python from time to time, from the thread that was called.
pub(crate) struct Watch {
    progress: Option<Py<PyAny>>,
    thread: ThreadId,
    stopped: AtomicBool,
    state: Mutex<State>,
}

struct State {
    asked: Instant,
    told: Instant,
    /// Why it was stopped.
    error: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        let now = Instant::now();
        Self {
            progress,
            thread: std::thread::current().id(),
            stopped: AtomicBool::new(false),
            state: Mutex::new(State { asked: now, told: now, error: None }),
        }
    }

    /// What was found, or the exception that stopped the search.
    pub(crate) fn finish<T>(self, found: Option<T>) -> PyResult<T> {
        let state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        match (state.error, found) {
            (Some(error), _) => Err(error),
            (None, Some(found)) => Ok(found),
            (None, None) => Err(pyo3::exceptions::PyKeyboardInterrupt::new_err(())),
        }
    }

    /// Calls Python where the last time is long enough ago; what it raises stops the run.
    fn call(
        &self,
        last: fn(&mut State) -> &mut Instant,
        what: impl FnOnce(Python<'_>) -> PyResult<()>,
    ) {
        if std::thread::current().id() != self.thread || self.stopped.load(Ordering::Relaxed) {
            return;
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let last = last(&mut state);
        if last.elapsed() < PATIENCE {
            return;
        }
        *last = Instant::now();
        if let Err(error) = Python::attach(what) {
            state.error = Some(error);
            self.stopped.store(true, Ordering::Relaxed);
        }
    }
}

impl Control for Watch {
    fn cancelled(&self) -> bool {
        self.call(|state| &mut state.asked, |py| py.check_signals());
        self.stopped.load(Ordering::Relaxed)
    }

    fn progress(&self, done: f64) {
        let Some(progress) = &self.progress else { return };
        self.call(|state| &mut state.told, |py| progress.call1(py, (done,)).map(drop));
    }
}
