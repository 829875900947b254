//! Ctrl-C, and SIGTERM, which batch systems send before the time is up.
//!
//! The first one asks whatever runs to stop soon, to write what it has finished. Work that looks at this often enough
//! says so by looking, and results that are being [written](writing) are waited for. Where nothing does, as while a scene
//! is prepared, what is known to be finished is written by a [`rescue`] instead, and the program ends. So does the
//! second one.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
#[cfg(unix)]
use std::{sync::Once, time::Duration};

/// The exit code of what was stopped.
pub(super) const STOPPED: u8 = 130;

/// How long work has to ask.
#[cfg(unix)]
const PATIENCE: Duration = Duration::from_millis(500);

static ASKED: AtomicBool = AtomicBool::new(false);
static HEARD: AtomicBool = AtomicBool::new(false);
static WORK: Mutex<Work> = Mutex::new(Work::NONE);

thread_local! {
    /// True on the thread that ends the program, which holds the lock of [`WORK`] until then.
    static ENDS: Cell<bool> = const { Cell::new(false) };
}

/// Writes what is finished.
type Rescue = Box<dyn FnOnce() + Send>;

/// What a signal finds.
struct Work {
    /// What writes all that is finished by now, with the number of its [`Kept`].
    rescue: Option<(u64, Rescue)>,
    /// The number that the next [`Kept`] gets.
    next: u64,
    /// How many [`Writing`] there are.
    writing: usize,
    /// How often writing has begun or ended.
    changes: u64,
}

impl Work {
    const NONE: Self = Self { rescue: None, next: 0, writing: 0, changes: 0 };

    fn rescue(&mut self, write: Rescue) -> u64 {
        let number = self.next;
        self.next += 1;
        self.rescue = Some((number, write));
        number
    }

    fn withdraw(&mut self, number: u64) {
        self.rescue.take_if(|(of, _)| *of == number);
    }

    fn begin(&mut self) {
        self.writing += 1;
        self.changes += 1;
    }

    fn end(&mut self) {
        self.writing -= 1;
        self.changes += 1;
    }

    /// True where nothing is written, and nothing was since `changes` were counted.
    #[cfg(unix)]
    fn is_idle_since(&self, changes: u64) -> bool {
        self.writing == 0 && self.changes == changes
    }
}

fn work() -> MutexGuard<'static, Work> {
    WORK.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts to listen.
#[cfg(unix)]
pub(super) fn listen() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

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

/// Leaves signals to the system, which knows no others.
#[cfg(not(unix))]
pub(super) fn listen() {}

/// Ends the program where no work has asked in time whether it shall stop.
#[cfg(unix)]
fn end_the_deaf() {
    let mut changes = work().changes;
    loop {
        std::thread::sleep(PATIENCE);
        let mut work = work();
        if HEARD.load(Ordering::SeqCst) {
            return;
        }
        if work.is_idle_since(changes) {
            // The lock is held to the end, so that nobody begins to write beside the rescue.
            ENDS.set(true);
            if let Some((_, write)) = work.rescue.take() {
                write();
            }
            std::process::exit(STOPPED.into());
        }
        // What comes after the writing has as long to ask.
        changes = work.changes;
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
pub(super) fn rescue(write: impl FnOnce() + Send + 'static) -> Kept {
    Kept(work().rescue(Box::new(write)))
}

/// A [`rescue`], which is withdrawn when this is dropped. Where it has begun, that waits for the program's end.
#[must_use]
pub(super) struct Kept(u64);

impl Drop for Kept {
    fn drop(&mut self) {
        work().withdraw(self.0);
    }
}

/// Begins to write results, which a first signal waits for. Where a [`rescue`] has begun, this waits for the program's end.
pub(super) fn writing() -> Writing {
    let counts = !ENDS.get();
    if counts {
        work().begin();
    }
    Writing { counts }
}

/// Results on their way into files, until this is dropped.
#[must_use]
pub(super) struct Writing {
    /// False within a rescue.
    counts: bool,
}

impl Drop for Writing {
    fn drop(&mut self) {
        if self.counts {
            work().end();
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn writing_is_waited_for_and_what_follows_gets_its_time() {
        let mut work = Work::NONE;
        let before = work.changes;
        assert!(work.is_idle_since(before));
        work.begin();
        work.begin();
        work.end();
        assert!(!work.is_idle_since(work.changes));
        let during = work.changes;
        work.end();
        assert!(!work.is_idle_since(before) && !work.is_idle_since(during));
        assert!(work.is_idle_since(work.changes));
    }

    #[test]
    fn a_rescue_is_withdrawn_unless_another_has_replaced_it() {
        let mut work = Work::NONE;
        let first = work.rescue(Box::new(|| ()));
        let second = work.rescue(Box::new(|| ()));
        work.withdraw(first);
        assert!(work.rescue.is_some());
        work.withdraw(second);
        assert!(work.rescue.is_none());
    }
}
