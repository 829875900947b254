//! Reading files that somebody named.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::CliError;
use crate::error::Place;

/// Opens a file to be read. What is no regular file may never end, or wait for ever: it is refused.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    check(path)?;
    File::open(path)
}

/// All bytes of a regular file.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    let mut bytes = Vec::new();
    let room = usize::try_from(length).map_err(|_| io::ErrorKind::OutOfMemory)?;
    bytes.try_reserve_exact(room)?;
    // A file that grows while it is read does not grow without end.
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Refuses what is no regular file, without opening it.
pub(crate) fn check(path: &Path) -> io::Result<()> {
    let kind = path.metadata()?;
    if kind.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !kind.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    Ok(())
}

/// Refuses what is no regular file, with an error about the file.
#[cfg(feature = "command")]
pub(crate) fn checked(path: &Path) -> Result<(), CliError> {
    check(path).map_err(|e| unreadable(path, None, &e))
}

/// Reads a file that was named at `from`.
pub(crate) fn read_at(path: &Path, from: Option<&Place>) -> Result<Vec<u8>, CliError> {
    read(path).map_err(|e| unreadable(path, from, &e))
}

/// Why a file that was named at `from` cannot be read.
pub(crate) fn unreadable(path: &Path, from: Option<&Place>, e: &io::Error) -> CliError {
    match from {
        Some(place) => CliError::input(place, format!("cannot read {}: {e}", path.display())),
        None => CliError::input(&Place::file(path), format!("cannot read this file: {e}")),
    }
}

/// Reads a text file that was named at `from`.
pub(crate) fn read_text(path: &Path, from: Option<&Place>) -> Result<String, CliError> {
    let text = String::from_utf8(read_at(path, from)?);
    text.map_err(|_| unreadable(path, from, &not_text()))
}

/// The text that bytes stand for; messages call it `path`.
pub(crate) fn text_of<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a str, CliError> {
    str::from_utf8(bytes).map_err(|_| unreadable(path, None, &not_text()))
}

fn not_text() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text")
}
