//! Ctrl-C, and SIGTERM, which batch systems send before the time is up.
//!
//! The first one asks whatever runs to stop soon, to write what it has finished. Work that looks at this often enough
//! says so by looking. Where nothing does, as while a scene is prepared, what is known to be finished is written by a
//! [`rescue`] instead, and the program ends. So does the second one.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once, PoisonError};
use std::time::Duration;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// The exit code of what was stopped.
pub(super) const STOPPED: u8 = 130;

/// How long work has to ask.
const PATIENCE: Duration = Duration::from_millis(500);

static ASKED: AtomicBool = AtomicBool::new(false);
static HEARD: AtomicBool = AtomicBool::new(false);
static RESCUE: Mutex<Option<Rescue>> = Mutex::new(None);

/// Writes what is finished.
type Rescue = Box<dyn FnOnce() + Send>;

/// Starts to listen.
pub(super) fn listen() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Without a thread that listens, signals do what they did before.
        let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else { return };
        let _ = std::thread::Builder::new().name("signals".into()).spawn(move || {
            for _ in signals.forever() {
                if ASKED.swap(true, Ordering::SeqCst) {
                    std::process::exit(STOPPED.into());
                }
                let _ = std::thread::Builder::new().spawn(end_the_deaf);
            }
        });
    });
}

/// Ends the program where no work has asked in time whether it shall stop.
fn end_the_deaf() {
    std::thread::sleep(PATIENCE);
    if !HEARD.load(Ordering::SeqCst) {
        let kept = RESCUE.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(write) = kept {
            write();
        }
        std::process::exit(STOPPED.into());
    }
}

/// True when the run shall stop, which whoever asks is taken to do.
pub(super) fn asked() -> bool {
    let asked = ASKED.load(Ordering::Relaxed);
    if asked && !HEARD.load(Ordering::Relaxed) {
        HEARD.store(true, Ordering::SeqCst);
    }
    asked
}

/// What writes all that is finished by now, if the program must end before somebody looks; it replaces the one before.
pub(super) fn rescue(write: impl FnOnce() + Send + 'static) {
    *RESCUE.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(write));
}
