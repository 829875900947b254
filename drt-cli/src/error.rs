//! What can go wrong between a file and an image, and the exit code each failure stands for.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

use crate::wording::readable;

/// A place in an input file; lines and columns are counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: Arc<Path>,
    /// The line, where one is to blame.
    pub line: Option<u32>,
    /// The column in that line, where it is known.
    pub column: Option<u32>,
}

impl Place {
    /// A whole file.
    #[must_use]
    pub fn file(path: &Path) -> Self {
        Self { file: path.into(), line: None, column: None }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        for n in [self.line, self.column].into_iter().flatten() {
            write!(f, ":{n}")?;
        }
        Ok(())
    }
}

/// Something in an input that is passed over: harmless, but perhaps not meant.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Warning {
    /// Where.
    pub place: Place,
    /// What it is, and what becomes of it.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}

/// Why a command could not do what it was asked.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum CliError {
    /// A file that cannot be used; the message names the element or key and what was expected.
    #[error("{place}: {message}")]
    Input {
        /// Where.
        place: Place,
        /// What is wrong, and what was expected.
        message: String,
    },
    /// An argument that cannot be used.
    #[error("{0}")]
    Argument(String),
    /// A fit that cannot go on; what it reached is stored.
    #[error("{0}")]
    Unsolved(String),
    /// A result that cannot be written.
    #[error("cannot write {}: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The cause.
        reason: String,
    },
}

impl CliError {
    /// An unusable input.
    pub fn input(place: &Place, message: impl fmt::Display) -> Self {
        Self::Input { place: place.clone(), message: readable(&message.to_string()) }
    }

    /// An unusable argument.
    pub fn argument(message: impl fmt::Display) -> Self {
        Self::Argument(readable(&message.to_string()))
    }

    /// A failure to write.
    pub fn write(path: &Path, reason: impl fmt::Display) -> Self {
        Self::Write { path: path.into(), reason: readable(&reason.to_string()) }
    }

    /// A fit that cannot go on.
    pub fn unsolved(message: impl fmt::Display) -> Self {
        Self::Unsolved(readable(&message.to_string()))
    }

    /// The exit code of the command: 1 for a fit that failed, 2 for unusable input or arguments, 3 for a failure to write.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input { .. } | Self::Argument(_) => 2,
            Self::Unsolved(_) => 1,
            Self::Write { .. } => 3,
        }
    }
}
