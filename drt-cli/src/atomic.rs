//! Files that appear complete or not at all.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::CliError;

/// Writes a file under another name in the same folder and renames it when all of it is stored.
/// An existing file is replaced in one step.
///
/// # Errors
/// When the folder or the file cannot be written, or `write` fails.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), Box<dyn std::error::Error>>,
) -> Result<(), CliError> {
    check_target(path)?;
    let draft = draft_of(path);
    let stored = (|| -> Result<(), Box<dyn std::error::Error>> {
        let mut out = BufWriter::new(File::create(&draft)?);
        write(&mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        Ok(fs::rename(&draft, path)?)
    })();
    stored.map_err(|e| {
        // What is left of the draft helps nobody; that it cannot be removed changes nothing.
        let _ = fs::remove_file(&draft);
        CliError::write(path, e)
    })
}

/// Refuses a place where no file can be put, before hours of work are spent for it.
///
/// # Errors
/// When the folder does not exist, or the name is taken by something other than a file.
pub fn check_target(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(CliError::write(path, format!("there is no folder {}", folder.display())));
    }
    if path.file_name().is_none() || (path.exists() && !path.is_file()) {
        return Err(CliError::write(path, "it is not a file that could be replaced"));
    }
    Ok(())
}

/// Removes the drafts that runs left in a folder when they were killed. None may be running there.
pub(crate) fn remove_drafts(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        if is_draft(&name.to_string_lossy()) {
            // One that stays does no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// True for the names that [`draft_of`] gives.
fn is_draft(name: &str) -> bool {
    let inner = name.strip_prefix('.').and_then(|rest| rest.strip_suffix(".tmp"));
    let process = inner.and_then(|rest| rest.rsplit_once('.')).map(|(_, process)| process);
    process.is_some_and(|p| !p.is_empty() && p.bytes().all(|b| b.is_ascii_digit()))
}

fn draft_of(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.tmp", std::process::id()));
    path.with_file_name(name)
}
