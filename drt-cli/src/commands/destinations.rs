//! Where results go, looked at before any work is done.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::{CliError, check_target};

/// Files to be written, each with the option or job that names it.
#[derive(Default)]
pub(super) struct Destinations {
    files: Vec<(String, Identity)>,
    /// The first file of each name, and of each number.
    by_name: BTreeMap<PathBuf, usize>,
    by_number: BTreeMap<(u64, u64), usize>,
    /// The first file that has been named before, and that.
    twice: Option<[usize; 2]>,
}

impl Destinations {
    /// The files of those options that are given; `-` is the standard output, and no file.
    pub(super) fn new<'p>(
        options: impl IntoIterator<Item = (impl ToString, Option<&'p Path>)>,
    ) -> Self {
        let mut all = Self::default();
        for (option, path) in options {
            if let Some(path) = path.filter(|path| path.as_os_str() != "-") {
                all.add(option.to_string(), Identity::of(path));
            }
        }
        all
    }

    fn add(&mut self, option: String, file: Identity) {
        let number = self.files.len();
        let before = self.find(&file);
        self.twice = self.twice.or(before.map(|before| [before, number]));
        self.by_name.entry(file.whole.clone()).or_insert(number);
        if let Some(inode) = file.number {
            self.by_number.entry(inode).or_insert(number);
        }
        self.files.push((option, file));
    }

    fn find(&self, file: &Identity) -> Option<usize> {
        let by_number = || self.by_number.get(file.number.as_ref()?);
        self.by_name.get(&file.whole).or_else(by_number).copied()
    }

    /// Refuses places that cannot be written, and files with two contents.
    pub(super) fn check(&self) -> Result<(), CliError> {
        self.distinct()?;
        self.files.iter().try_for_each(|(_, file)| check_target(&file.path))
    }

    /// Refuses files with two contents.
    pub(super) fn distinct(&self) -> Result<(), CliError> {
        let Some(twice) = self.twice else { return Ok(()) };
        let [(other, _), (option, file)] = twice.map(|i| &self.files[i]);
        let path = file.path.display();
        Err(CliError::argument(format!(
            "{option}: {path} is what {other} names, too; expected a file for each"
        )))
    }

    /// Refuses to overwrite what is read.
    pub(super) fn spare<'p>(
        &self,
        read: impl IntoIterator<Item = &'p Path>,
    ) -> Result<(), CliError> {
        if self.files.is_empty() {
            return Ok(());
        }
        let found = read.into_iter().find_map(|input| self.find(&Identity::of(input)));
        found.map(|i| &self.files[i]).map_or(Ok(()), |(option, file)| {
            Err(CliError::argument(format!(
                "{option}: {} is read by this command, and would be overwritten; expected another file",
                file.path.display()
            )))
        })
    }
}

/// Refuses a file whose name does not end as what would be in it.
pub(super) fn check_ending(option: &str, path: &Path, known: &[&str]) -> Result<(), CliError> {
    if known.iter().any(|ending| ends_with(path, ending)) {
        return Ok(());
    }
    let known: Vec<String> = known.iter().map(|ending| format!(".{ending}")).collect();
    let message = format!(
        "{option}: {}: expected a file that ends in {}",
        path.display(),
        known.join(" or ")
    );
    Err(CliError::argument(message))
}

/// True for a name with this ending, in capitals or not.
pub(super) fn ends_with(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Folder;

    #[test]
    fn files_are_known_by_any_of_their_names() {
        let folder = Folder::new();
        let file = folder.file("a.exr", "");
        std::fs::create_dir(folder.path().join("b")).unwrap();
        let again = folder.path().join("b/../a.exr");
        let other = folder.path().join("c.exr");
        let of = |paths: &[&Path]| Destinations::new(paths.iter().map(|p| ("job", Some(*p))));
        let message = of(&[&other, &file, &again]).distinct().unwrap_err().to_string();
        assert!(message.contains("a.exr is what job names, too"), "{message}");
        assert!(of(&[&other, &file]).distinct().is_ok());
        let message = of(&[&other, &file]).spare([&*again]).unwrap_err().to_string();
        assert!(message.contains("a.exr is read by this command"), "{message}");
        assert!(of(&[&other, Path::new("-")]).spare([&*file, Path::new("-")]).is_ok());
        #[cfg(unix)]
        {
            let link = folder.path().join("hard.exr");
            std::fs::hard_link(&file, &link).unwrap();
            assert!(of(&[&file]).spare([&*link]).is_err());
        }
    }
}
