//! What a stopped run goes on from.

use std::io::Write;
use std::path::Path;

use drt_motion::optimize::State;
use serde::{Deserialize, Serialize};

use crate::atomic::write_atomically;
use crate::error::{Place, read_text};
use crate::fingerprint::Fingerprint;
use crate::{CliError, PROGRAM};

/// The name of the file. It is replaced last: what else is in the folder is at least as new, and what
/// is newer is made anew.
const FILE: &str = "checkpoint.json";

/// The state after some steps.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct Checkpoint {
    pub(super) program: String,
    /// Of all that decides the run's steps.
    pub(super) fingerprint: Fingerprint,
    pub(super) optimizer: State,
    /// Iterations in a row in which each parameter changed nothing.
    pub(super) blind: Vec<u32>,
    /// True when all iterations were made and the last values were looked at.
    #[serde(default)]
    pub(super) complete: bool,
    /// Of all runs so far.
    pub(super) seconds: f64,
    pub(super) cpu_seconds: f64,
}

impl Checkpoint {
    /// Reads the checkpoint of a folder, where there is one.
    pub(super) fn read(folder: &Path, fingerprint: Fingerprint) -> Result<Option<Self>, CliError> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let text = read_text(&path, None)?;
        let fail = |message: String| CliError::input(&Place::file(&path), message);
        let read: Self = serde_json::from_str(&text)
            .map_err(|e| fail(format!("it is not a checkpoint: {e}; --restart begins anew")))?;
        if read.fingerprint != fingerprint {
            return Err(fail(
                "it belongs to another problem: job, options or targets have changed since; \
                 --restart begins anew, and another `checkpoint` folder keeps this one"
                    .into(),
            ));
        }
        if read.program != PROGRAM {
            return Err(fail(format!(
                "it was written by {}, whose random numbers may differ; --restart begins anew",
                read.program
            )));
        }
        Ok(Some(read))
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), CliError> {
        let path = folder.join(FILE);
        write_atomically(&path, |out| {
            serde_json::to_writer(&mut *out, self)?;
            Ok(writeln!(out)?)
        })
    }
}
