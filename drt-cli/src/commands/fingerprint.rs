//! Telling inputs apart by a hash.

use std::fmt;
use std::io::{self, Write};

use drt_estimators::Settings;
use serde::{Deserialize, Serialize};

use crate::{CliError, Job, PROGRAM};

/// The FNV-1a hash (Fowler, Noll and Vo) of whatever is written to it.
#[derive(Clone, Copy, Debug, Deserialize, Eq, PartialEq, Serialize)]
pub(crate) struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fingerprint {
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Of all that decides the results of `command` on a job: the scene as read, with meshes and grids, the
    /// parameters and settings but for threads, the number of samples, `further` options, and the version of the program.
    /// Where files lie and how they are laid out has no part in it.
    pub(crate) fn of_job(job: &Job, command: &str, further: &[&str]) -> Result<Self, CliError> {
        let settings = Settings { threads: 0, ..job.settings.clone() };
        let mut sum = Self::default();
        let groups = format!("{:?}", job.groups);
        let facts = (PROGRAM, command, further, job.spp(), settings, &job.parameters, groups);
        serde_json::to_writer(&mut sum, &facts)
            .and_then(|()| serde_json::to_writer(&mut sum, &job.scene))
            .map_err(|e| CliError::input(&crate::error::Place::file(&job.path), e))?;
        Ok(sum)
    }
}

impl Write for Fingerprint {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.add(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}
