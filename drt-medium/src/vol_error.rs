use std::string::String;

use crate::MediumError;

/// Why a file of a volume cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolError {
    /// The system refused.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// A header field or value is not what the format allows.
    #[error("{file}, byte {offset}: {field} is {found}, expected {expected}")]
    Field {
        /// The file.
        file: String,
        /// Where in the file.
        offset: usize,
        /// What stands there.
        field: &'static str,
        /// What was found.
        found: String,
        /// What the format allows.
        expected: &'static str,
    },
    /// The file ends too early.
    #[error("{file} is cut off at byte {found}: its header announces {expected} bytes")]
    Cut {
        /// The file.
        file: String,
        /// Bytes there.
        found: usize,
        /// Bytes needed; `usize::MAX` when no file could be that large.
        expected: usize,
    },
    /// The values do not form a grid.
    #[error("{file}: {source}")]
    Grid {
        /// The file.
        file: String,
        /// What is wrong with it.
        source: MediumError,
    },
    /// A grid cannot be stored in this format.
    #[error("the grid cannot be written: {0}")]
    NotStorable(&'static str),
}
