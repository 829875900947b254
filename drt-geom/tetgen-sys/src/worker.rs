//! The process that runs the library: see the README for why it is a program and not a fork.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio, id};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::Error;

/// The program, built from `worker.cpp`.
static WORKER: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/worker"));

/// Exit codes from here on carry an error code of the library's.
const REFUSED: i32 = 64;

/// Runs the worker on a request and returns its answer, a whole one or, from a process whose end
/// nobody could see, maybe a part.
///
/// Request and answer are files, not pipes: nobody must read while writing, and no worker that
/// ends early can raise a SIGPIPE here.
pub(crate) fn run(request: &[u8], limit: Duration) -> Result<Vec<u8>, Error> {
    let place = Place::new()?;
    let [program, question, answer] = ["worker", "request", "answer"].map(|n| place.path.join(n));
    let unusable = |source| Error::Directory { path: place.path.clone(), source };
    write(&program, WORKER, 0o700).map_err(unusable)?;
    write(&question, request, 0o600).map_err(unusable)?;
    let input = File::open(&question).map_err(unusable)?;
    let output = File::create_new(&answer).map_err(unusable)?;
    let mut command = Command::new(&program);
    command.stdin(input).stdout(output).stderr(Stdio::null());
    let worker = start(command).map_err(|source| Error::Start { path: program.clone(), source })?;
    let status = wait(worker, limit)?;
    // A host that ignores SIGCHLD, or reaps every child itself, leaves no status to see.
    if let Some(failure) = status.and_then(failure) {
        return Err(failure);
    }
    fs::read(&answer).map_err(unusable)
}

/// Starts a program that was written just now. A process that another thread forked in between
/// holds the file open for writing until it runs its own program, which takes no longer than a moment.
fn start(mut command: Command) -> io::Result<Child> {
    let begin = Instant::now();
    loop {
        match command.spawn() {
            Err(e)
                if e.kind() == io::ErrorKind::ExecutableFileBusy
                    && begin.elapsed() < Duration::from_secs(2) =>
            {
                sleep(Duration::from_millis(1));
            }
            result => return result,
        }
    }
}

/// Waits for the worker's end: its status, where that can be had.
fn wait(mut worker: Child, limit: Duration) -> Result<Option<ExitStatus>, Error> {
    let begin = Instant::now();
    let mut pause = Duration::from_micros(500);
    loop {
        match worker.try_wait() {
            Ok(Some(status)) => return Ok(Some(status)),
            // There is no such child any more.
            Err(_) => return Ok(None),
            Ok(None) => {}
        }
        let Some(left) = limit.checked_sub(begin.elapsed()) else {
            // Either fails only for a process that has ended by itself.
            let _ = worker.kill();
            let _ = worker.wait();
            return Err(Error::TimedOut { limit });
        };
        sleep(pause.min(left));
        pause = (2 * pause).min(Duration::from_millis(10));
    }
}

fn failure(status: ExitStatus) -> Option<Error> {
    match (status.code(), status.signal()) {
        (Some(0), _) => None,
        (Some(code), _) if (REFUSED..REFUSED + 32).contains(&code) => {
            let code = code - REFUSED;
            Some(Error::Refused { code, reason: reason(code) })
        }
        (Some(32), _) => Some(Error::Ended { how: "it could not read the request".into() }),
        (Some(33), _) => Some(Error::Ended {
            how: "it could not write the answer; is the temporary directory full?".into(),
        }),
        (Some(34), _) => Some(Error::Ended { how: "out of memory".into() }),
        (Some(127), _) => Some(Error::Ended {
            how: "exit code 127; is the TetGen library installed (Debian: libtet1.5)?".into(),
        }),
        (Some(code), _) => Some(Error::Ended { how: format!("exit code {code}") }),
        (None, signal) => Some(Error::Ended { how: format!("signal {}", signal.unwrap_or(0)) }),
    }
}

/// The meanings of the library's codes, as in its header.
fn reason(code: i32) -> &'static str {
    match code {
        1 => "out of memory",
        2 => "an internal error",
        3 => "the triangles intersect",
        4 => "a feature is too small for its tolerance",
        5 => "two facets are too close to each other",
        10 => "an error in the input",
        _ => "an error of an unknown kind",
    }
}

fn write(path: &Path, bytes: &[u8], mode: u32) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).mode(mode).open(path)?;
    file.write_all(bytes)
}

/// A directory that only this user can enter, gone when dropped.
struct Place {
    path: PathBuf,
}

impl Place {
    fn new() -> Result<Self, Error> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        loop {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let path = std::env::temp_dir().join(format!("tetgen-{}-{number}", id()));
            match DirBuilder::new().mode(0o700).create(&path) {
                Ok(()) => return Ok(Self { path }),
                // Left over from a process of the same number.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(source) => return Err(Error::Directory { path, source }),
            }
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // What cannot be removed is the temporary directory's own matter.
        let _ = fs::remove_dir_all(&self.path);
    }
}
