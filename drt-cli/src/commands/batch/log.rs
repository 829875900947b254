//! What happened, a JSON object a line.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

use super::list::Entry;
use crate::files::input_file;
use crate::{CliError, PROGRAM};

/// Something that happened to a job.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Event<'a> {
    pub(super) event: &'static str,
    /// The hash of its inputs, where they could be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) inputs: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) seconds: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) error: Option<&'a str>,
    /// What was passed over in the inputs.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub(super) warnings: &'a [String],
}

impl Event<'_> {
    pub(super) fn new(event: &'static str) -> Self {
        Self { event, inputs: None, seconds: None, error: None, warnings: &[] }
    }
}

#[derive(Serialize)]
struct Line<'a> {
    /// Seconds since 1970.
    time: f64,
    program: &'static str,
    job: String,
    output: String,
    #[serde(flatten)]
    event: Event<'a>,
}

/// A file that lines are only ever added to.
pub(super) struct Log {
    path: PathBuf,
    file: File,
}

impl Log {
    /// Opens a log; the start of a line that was being written when its writer was killed is ended.
    pub(super) fn open(path: &Path) -> Result<Self, CliError> {
        let fail = |e: std::io::Error| CliError::write(path, e);
        if path.exists() {
            input_file::check(path).map_err(fail)?;
        }
        let mut file =
            OpenOptions::new().read(true).append(true).create(true).open(path).map_err(fail)?;
        let mut last = [b'\n'];
        if file.metadata().map_err(fail)?.len() > 0 {
            file.seek(SeekFrom::End(-1)).map_err(fail)?;
            file.read_exact(&mut last).map_err(fail)?;
        }
        if last != [b'\n'] {
            file.write_all(b"\n").map_err(fail)?;
        }
        Ok(Self { path: path.into(), file })
    }

    /// Adds a line, in one piece.
    pub(super) fn add(&self, entry: &Entry, event: Event<'_>) -> Result<(), CliError> {
        let time = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64());
        let line = Line {
            time,
            program: PROGRAM,
            job: entry.to_string(),
            output: entry.output().display().to_string(),
            event,
        };
        let fail = |e: &dyn std::fmt::Display| CliError::write(&self.path, e);
        let mut text = serde_json::to_vec(&line).map_err(|e| fail(&e))?;
        text.push(b'\n');
        (&self.file).write_all(&text).map_err(|e| fail(&e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Folder;

    #[test]
    fn torn_lines_are_ended() {
        let folder = Folder::new();
        let path = folder.file("log", "{\"a\":1}\n{\"b\":");
        for _ in 0..2 {
            drop(Log::open(&path).unwrap());
        }
        assert_eq!(std::fs::read_to_string(path).unwrap(), "{\"a\":1}\n{\"b\":\n");
    }
}
