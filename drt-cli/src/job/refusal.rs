//! Why an effect of a job cannot be read.

use crate::CliError;

/// Why an effect cannot be used.
pub(super) enum Refusal {
    /// Its keys do not make sense together; told with the place of the effect.
    Keys(String),
    /// A file it names is unusable.
    File(CliError),
}

impl From<String> for Refusal {
    fn from(message: String) -> Self {
        Self::Keys(message)
    }
}
