//! What goes to the standard output and to the standard error.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use crate::CliError;

/// Prints a result. Where its reader has gone there is nothing left to do, which is no failure.
///
/// # Errors
/// When the standard output takes no more, as on a full disk.
pub(crate) fn print(text: impl AsRef<[u8]>) -> Result<(), CliError> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_ref()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(CliError::write(Path::new("to the standard output"), e))
        }
        _ => Ok(()),
    }
}

/// Tells something beside the results, a line. Where nobody can read it, the work goes on.
pub(crate) fn note(line: impl fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}
