//! Why an effect of a job cannot be read.

use std::path::Path;

use crate::CliError;

/// Why an effect cannot be used.
pub(super) enum Refusal {
    /// Its keys do not make sense together; told with the place of the effect.
    Keys(String),
    /// A file it names is unusable.
    File(CliError),
}

impl Refusal {
    /// What a key names cannot be read.
    pub(super) fn unreadable(path: &Path, e: &std::io::Error) -> Self {
        Self::Keys(format!("cannot read {}: {e}", path.display()))
    }

    /// The error, where `fail` makes one of what is wrong with keys.
    pub(super) fn told(self, fail: impl FnOnce(String) -> CliError) -> CliError {
        match self {
            Self::Keys(message) => fail(message),
            Self::File(error) => error,
        }
    }
}

impl From<CliError> for Refusal {
    fn from(error: CliError) -> Self {
        Self::File(error)
    }
}

impl From<String> for Refusal {
    fn from(message: String) -> Self {
        Self::Keys(message)
    }
}
