//! The files and definitions that a fit is read from.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::commands::fingerprint::Fingerprint;
use crate::error::Place;
use crate::files::input_file;
use crate::{CliError, Job};

/// Hashes of all files that a fit reads, but for the job, and the values given for the scene's `<default>` names.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub(super) struct Sources {
    /// The hash of each file by its name from the job's folder on, so that a fit can be moved with all its files.
    files: BTreeMap<String, Fingerprint>,
    defaults: BTreeMap<String, String>,
}

impl Sources {
    pub(super) fn of(job: &Job) -> Result<Self, CliError> {
        let folder = job.path.parent().unwrap_or(Path::new(""));
        let mut files = BTreeMap::new();
        for path in job.inputs().chain(job.pictures()).filter(|path| *path != job.path) {
            let mut hash = Fingerprint::default();
            hash.add(&input_file::read_at(path, Some(&Place::file(&job.path)))?);
            let name = path.strip_prefix(folder).unwrap_or(path);
            files.insert(name.display().to_string(), hash);
        }
        Ok(Self { files, defaults: job.defaults.clone() })
    }

    /// What differs in `now`, as the start of a sentence.
    pub(super) fn changed(&self, now: &Self) -> Option<String> {
        for (name, hash) in &now.files {
            match self.files.get(name) {
                None => {
                    return Some(format!(
                        "{name} is read now and was not when the checkpoint was written"
                    ));
                }
                Some(before) if before != hash => return Some(format!("{name} has changed since")),
                Some(_) => {}
            }
        }
        if let Some(name) = self.files.keys().find(|name| !now.files.contains_key(*name)) {
            return Some(format!("{name} is not read any more"));
        }
        let told = |value: Option<&String>| match value {
            Some(value) => format!("`{value}`"),
            None => "not given".into(),
        };
        let names = self.defaults.keys().chain(now.defaults.keys());
        let mut pairs = names.map(|name| (name, self.defaults.get(name), now.defaults.get(name)));
        let (name, before, after) = pairs.find(|(_, before, after)| before != after)?;
        Some(format!("-D {name} was {} and is {} now", told(before), told(after)))
    }
}
