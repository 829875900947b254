//! Files that appear complete or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use tempfile::{Builder, NamedTempFile, TempPath};

use crate::CliError;

/// Writes a file aside and puts it in its place when all of it is stored. An existing file is replaced in one step.
///
/// On Linux the file has no name until then, so a program that is killed leaves nothing behind. Where the system
/// or the file system has no such files, or refuses to name them, it has a name in the same folder that nobody can
/// guess, `.drt-….tmp`, and a kill may leave it.
///
/// # Errors
/// When the folder or the file cannot be written, or `write` fails.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), Box<dyn std::error::Error>>,
) -> Result<(), CliError> {
    check_place(path)?;
    let stored = (|| -> Result<(), Box<dyn std::error::Error>> {
        let draft = Draft::new(folder_of(path))?;
        let mut out = BufWriter::new(draft.file);
        write(&mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        match draft.name {
            Some(name) => Ok(name.persist(path).map_err(|e| e.error)?),
            None => Ok(put_in_place(out.get_ref(), path)?),
        }
    })();
    stored.map_err(|e| CliError::write(path, e))
}

/// Refuses a place where no file can be put, before hours of work are spent for it.
///
/// # Errors
/// When the folder does not exist or takes no files, or the name is taken by something other than a file.
pub fn check_target(path: &Path) -> Result<(), CliError> {
    check_place(path)?;
    Draft::new(folder_of(path)).map(drop).map_err(|e| CliError::write(path, e))
}

/// Refuses a folder that can be neither written to nor made, before hours of work are spent for it. It makes none.
///
/// # Errors
/// Names the folder and what stands in the way.
pub fn check_folder(folder: &Path) -> Result<(), CliError> {
    let there = folder.ancestors().map(here).find(|f| f.symlink_metadata().is_ok());
    let there = there.unwrap_or(Path::new("."));
    if !there.is_dir() {
        let reason = format!("{} is not a folder", there.display());
        return Err(CliError::write(folder, reason));
    }
    Draft::new(there).map(drop).map_err(|e| CliError::write(folder, e))
}

fn check_place(path: &Path) -> Result<(), CliError> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(CliError::write(path, format!("there is no folder {}", folder.display())));
    }
    if path.file_name().is_none() || (path.exists() && !path.is_file()) {
        return Err(CliError::write(path, "it is not a file that could be replaced"));
    }
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    here(path.parent().unwrap_or(Path::new("")))
}

/// The folder that a path names, where the empty one is the present one.
fn here(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

/// A file on its way.
struct Draft {
    file: File,
    /// Where files without a name do not exist; it is removed unless it is persisted.
    name: Option<TempPath>,
}

impl Draft {
    fn new(folder: &Path) -> io::Result<Self> {
        if let Some(file) = nameless(folder)? {
            return Ok(Self { file, name: None });
        }
        let (file, name) = named(folder)?;
        Ok(Self { file, name: Some(name) })
    }
}

/// A new file under a name that nobody can guess.
fn named(folder: &Path) -> io::Result<(File, TempPath)> {
    let mut builder = names();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    Ok(builder.tempfile_in(folder)?.into_parts())
}

/// The names that drafts have where they need one.
fn names() -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(".drt-").suffix(".tmp").rand_bytes(16);
    builder
}

/// A file without a name; `None` where there can be none, which is no failure.
#[cfg(target_os = "linux")]
fn nameless(folder: &Path) -> io::Result<Option<File>> {
    use rustix::fs::{Mode, OFlags, open};
    use rustix::io::Errno;

    if !Path::new(OPEN_FILES).is_dir() {
        return Ok(None);
    }
    let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
    match open(folder, flags, Mode::from_raw_mode(0o666)) {
        Ok(file) => Ok(Some(file.into())),
        // What kernels and file systems without such files say.
        Err(Errno::OPNOTSUPP | Errno::ISDIR | Errno::NOENT | Errno::INVAL) => Ok(None),
        Err(e) => Err(e.into()),
    }
}

#[cfg(not(target_os = "linux"))]
fn nameless(_folder: &Path) -> io::Result<Option<File>> {
    Ok(None)
}

/// Where Linux shows the files that a process has open.
#[cfg(target_os = "linux")]
const OPEN_FILES: &str = "/proc/self/fd";

/// Gives a file without a name the one that it shall have.
#[cfg(target_os = "linux")]
fn put_in_place(file: &File, path: &Path) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    use std::os::fd::AsRawFd;

    let open = format!("{OPEN_FILES}/{}", file.as_raw_fd());
    put_by(file, path, |name| Ok(linkat(CWD, open.as_str(), CWD, name, AtFlags::SYMLINK_FOLLOW)?))
}

/// Gives a file a name by a link, or gives the name to a copy of it where links are refused, which shows only now.
#[cfg(target_os = "linux")]
fn put_by(file: &File, path: &Path, link: impl Fn(&Path) -> io::Result<()>) -> io::Result<()> {
    let linked = match link(path) {
        // A link cannot replace a file, but a rename can.
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {
            let named: io::Result<NamedTempFile<()>> = names().make_in(folder_of(path), &link);
            named.and_then(|named| Ok(named.persist(path).map(drop)?))
        }
        result => result,
    };
    linked.or_else(|_| copy_in_place(file, path))
}

#[cfg(target_os = "linux")]
fn copy_in_place(mut file: &File, path: &Path) -> io::Result<()> {
    use std::io::Seek;

    let (mut copy, name) = named(folder_of(path))?;
    file.rewind()?;
    io::copy(&mut file, &mut copy)?;
    copy.sync_all()?;
    Ok(name.persist(path)?)
}

#[cfg(not(target_os = "linux"))]
fn put_in_place(_file: &File, _path: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Folder;

    fn files(folder: &Folder) -> Vec<String> {
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let folder = Folder::new();
        let path = folder.path().join("a");
        for text in ["first", "second, which replaces it"] {
            write_atomically(&path, |out| Ok(out.write_all(text.as_bytes())?)).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
        let failed = write_atomically(&path, |out| {
            out.write_all(b"half")?;
            Err("no more".into())
        });
        assert!(failed.unwrap_err().to_string().contains("no more"));
        assert!(std::fs::read_to_string(&path).unwrap().starts_with("second"));
        check_target(&folder.path().join("b")).unwrap();
        assert_eq!(files(&folder), ["a"]);
    }

    /// While a draft has no name, nobody who is killed can leave it.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_draft_shows_nowhere() {
        let folder = Folder::new();
        let path = folder.path().join("a");
        let write = |out: &mut BufWriter<File>| {
            out.write_all(&[0; 100_000])?;
            out.flush()?;
            assert_eq!(files(&folder), [""; 0]);
            Ok(())
        };
        write_atomically(&path, write).unwrap();
        assert_eq!(files(&folder), ["a"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn where_links_are_refused_a_copy_gets_the_name() {
        use io::ErrorKind::{AlreadyExists, PermissionDenied};

        let folder = Folder::new();
        let path = folder.path().join("a");
        for text in ["first", "second, which replaces it"] {
            let draft = Draft::new(folder.path()).unwrap();
            (&draft.file).write_all(text.as_bytes()).unwrap();
            let refuse = |name: &Path| {
                let kind = if name.exists() { AlreadyExists } else { PermissionDenied };
                Err(kind.into())
            };
            put_by(&draft.file, &path, refuse).unwrap();
            drop(draft);
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
            assert_eq!(files(&folder), ["a"]);
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_are_replaced_and_not_followed() {
        let folder = Folder::new();
        let other = folder.file("other", "mine");
        let path = folder.path().join("link");
        std::os::unix::fs::symlink(&other, &path).unwrap();
        write_atomically(&path, |out| Ok(out.write_all(b"new")?)).unwrap();
        assert_eq!(std::fs::read_to_string(&other).unwrap(), "mine");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    }

    #[test]
    fn places_without_files_are_found_before_the_work() {
        let folder = Folder::new();
        let file = folder.file("file", "");
        for path in [folder.path().join("none/a"), folder.path().into(), file.join("a")] {
            assert!(check_target(&path).is_err(), "{}", path.display());
        }
        assert!(check_folder(&folder.path().join("not/yet/there")).is_ok());
        assert!(check_folder(&file.join("a")).is_err());
        assert_eq!(files(&folder), ["file"]);
    }
}
