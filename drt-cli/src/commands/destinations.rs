//! Where results go, looked at before any work is done.

use std::path::{Path, PathBuf};

use crate::{CliError, check_target};

/// Files to be written, each with the option that names it.
#[derive(Default)]
pub(super) struct Destinations(Vec<(&'static str, Identity)>);

impl Destinations {
    /// The files of the options that are given; `-` is the standard output, and no file.
    pub(super) fn new<'p>(
        options: impl IntoIterator<Item = (&'static str, Option<&'p Path>)>,
    ) -> Self {
        let given = options.into_iter().filter_map(|(option, path)| Some((option, path?)));
        let files = given.filter(|(_, path)| path.as_os_str() != "-");
        Self(files.map(|(option, path)| (option, Identity::of(path))).collect())
    }

    /// Refuses places that cannot be written, and files with two contents.
    pub(super) fn check(&self) -> Result<(), CliError> {
        for (i, (option, file)) in self.0.iter().enumerate() {
            if let Some((other, _)) = self.0[..i].iter().find(|(_, f)| f.is(file)) {
                let path = file.path.display();
                return Err(CliError::argument(format!(
                    "{option}: {path} is what {other} names, too; expected a file for each"
                )));
            }
            check_target(&file.path)?;
        }
        Ok(())
    }

    /// Refuses to overwrite what is read.
    pub(super) fn spare<'p>(
        &self,
        read: impl IntoIterator<Item = &'p Path>,
    ) -> Result<(), CliError> {
        if self.0.is_empty() {
            return Ok(());
        }
        for input in read {
            let input = Identity::of(input);
            if let Some((option, file)) = self.0.iter().find(|(_, f)| f.is(&input)) {
                return Err(CliError::argument(format!(
                    "{option}: {} is read by this command, and would be overwritten; expected another file",
                    file.path.display()
                )));
            }
        }
        Ok(())
    }
}

/// A file, however it is called.
struct Identity {
    path: PathBuf,
    whole: PathBuf,
    /// Device and number, where the system has these.
    number: Option<(u64, u64)>,
}

impl Identity {
    fn of(path: &Path) -> Self {
        Self { path: path.into(), whole: whole_name(path), number: number(path) }
    }

    fn is(&self, other: &Self) -> bool {
        self.whole == other.whole || self.number.is_some() && self.number == other.number
    }
}

/// The one name of a file without links, as far as it or its folder exists.
pub(super) fn whole_name(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let by_folder = || Some(folder.canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(by_folder).unwrap_or_else(|| path.into())
}

#[cfg(unix)]
fn number(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    path.metadata().ok().map(|m| (m.dev(), m.ino()))
}

#[cfg(not(unix))]
fn number(_path: &Path) -> Option<(u64, u64)> {
    None
}
