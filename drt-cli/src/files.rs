//! Input files.

use std::path::Path;

/// Refuses what is no regular file: a device or a pipe may go on for ever or never begin.
///
/// # Errors
/// Says what it is, or why that cannot be known.
pub(crate) fn regular(path: &Path) -> Result<(), String> {
    let kind = std::fs::metadata(path).map_err(|err| err.to_string())?.file_type();
    if kind.is_file() {
        return Ok(());
    }
    let what = if kind.is_dir() { "a folder" } else { "a device, pipe or socket" };
    Err(format!("it is {what}; expected a regular file"))
}

/// Refuses a header that claims more bytes than a file of this length can hold, whatever its compression: deflate makes at most
/// 1032 of one.
///
/// # Errors
/// Names both lengths.
pub(crate) fn plausible(claimed: u64, length: u64) -> Result<(), String> {
    const MOST: u64 = 1032;
    // Headers and tables are not compressed, and what is nearly empty may be a little over.
    if claimed <= MOST.saturating_mul(length.saturating_add(64)) {
        return Ok(());
    }
    Err(format!("its header claims {claimed} bytes, which a file of {length} bytes cannot hold"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_are_read() {
        let folder = crate::testing::Folder::new();
        assert!(regular(&folder.file("a", "")).is_ok());
        assert!(regular(folder.path()).unwrap_err().contains("a folder"));
        assert!(regular(&folder.path().join("b")).is_err());
        #[cfg(unix)]
        assert!(regular(Path::new("/dev/zero")).unwrap_err().contains("a device"));
    }

    #[test]
    fn claims_are_held_against_the_length() {
        assert!(plausible(1 << 20, 1 << 11).is_ok());
        assert!(plausible(1 << 40, 1 << 20).unwrap_err().contains("cannot hold"));
    }
}
