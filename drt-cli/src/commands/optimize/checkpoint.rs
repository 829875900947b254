//! What a stopped run goes on from.

use std::io::Write;
use std::path::Path;

use drt_motion::optimize::State;
use drt_motion::optimize::field::FieldState;
use serde::{Deserialize, Serialize};

use crate::commands::fingerprint::Fingerprint;
use crate::error::Place;
use crate::files::atomic::write_atomically;
use crate::files::input_file::read_text;

use super::sources::Sources;
use crate::files::checksum;
use crate::{CliError, PROGRAM};

/// The name of the file. It is replaced last: what else is in the folder is at least as new, and what
/// is newer is made anew.
pub(super) const FILE: &str = "checkpoint.json";

/// The state after some steps.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct Checkpoint {
    pub(super) program: String,
    /// Of all that decides the run's steps.
    pub(super) fingerprint: Fingerprint,
    pub(super) optimizer: State,
    /// The states of the groups of unknowns, in the job's order.
    pub(super) fields: Vec<FieldState>,
    /// Iterations in a row in which each parameter changed nothing.
    pub(super) blind: Vec<u32>,
    /// True when all iterations were made and the last values were looked at.
    #[serde(default)]
    pub(super) complete: bool,
    /// Of all runs so far.
    pub(super) seconds: f64,
    pub(super) cpu_seconds: f64,
    /// What decides the steps, file by file.
    pub(super) sources: Sources,
    /// Checksums of the tables of values and losses, as far as they belong to the steps.
    pub(super) tables: [u32; 2],
}

impl Checkpoint {
    /// Reads the checkpoint of a folder, where there is one.
    pub(super) fn read(
        folder: &Path,
        fingerprint: Fingerprint,
        sources: &Sources,
    ) -> Result<Option<Self>, CliError> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let text = read_text(&path, None)?;
        let fail = |message: String| CliError::input(&Place::file(&path), message);
        if !checksum::is_whole_json(&text) {
            let message = "it is damaged, or of another version: its checksum does not fit";
            return Err(fail(format!("{message}; --restart begins anew")));
        }
        let read: Self = serde_json::from_str(&text)
            .map_err(|e| fail(format!("it is not a checkpoint: {e}; --restart begins anew")))?;
        if read.program != PROGRAM {
            return Err(fail(format!(
                "it was written by {}, whose random numbers may differ; --restart begins anew",
                read.program
            )));
        }
        let changed = read.sources.changed(sources).or_else(|| {
            let other = "job, options or targets have changed since";
            (read.fingerprint != fingerprint).then(|| other.into())
        });
        if let Some(what) = changed {
            return Err(fail(format!(
                "it belongs to another problem: {what}; --restart begins anew, and another \
                 `checkpoint` folder keeps this one"
            )));
        }
        Ok(Some(read))
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), CliError> {
        let path = folder.join(FILE);
        write_atomically(&path, |out| {
            Ok(out.write_all(checksum::seal_json(&serde_json::to_string(self)?).as_bytes())?)
        })
    }
}

#[cfg(test)]
mod tests {
    use drt_motion::optimize::{Method, Optimizer, Variable};

    use super::*;
    use crate::testing::{Folder, damaged};

    #[test]
    fn every_damaged_checkpoint_is_refused() {
        let folder = Folder::new();
        let optimizer = Optimizer::new(Method::ADAM, vec![Variable::default()], &[0.25]).unwrap();
        let (fingerprint, sources) = (Fingerprint::default(), Sources::default());
        let checkpoint = Checkpoint {
            program: PROGRAM.into(),
            fingerprint,
            optimizer: optimizer.state().clone(),
            fields: Vec::new(),
            blind: vec![0],
            complete: false,
            seconds: 1.5,
            cpu_seconds: 2.5,
            sources: sources.clone(),
            tables: [1, 2],
        };
        checkpoint.write(folder.path()).unwrap();
        let read = || Checkpoint::read(folder.path(), fingerprint, &sources);
        assert_eq!(read().unwrap().unwrap().optimizer, checkpoint.optimizer);
        let file = std::fs::read(folder.path().join(FILE)).unwrap();
        for copy in damaged(&file, 1000) {
            folder.file(FILE, copy);
            assert!(read().is_err());
        }
    }
}
