//! What a shell wants to know of the command line: completions and manual pages.

use std::path::Path;

use clap::CommandFactory;

use super::Outcome;
use super::options::CommandLine;
use crate::{CliError, check_target, console};

/// Prints what completes commands.
pub(super) fn completions(shell: clap_complete::Shell) -> Result<Outcome, CliError> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut CommandLine::command(), "drt", &mut text);
    console::print(text).map(|()| Outcome::Done)
}

/// Prints the manual page, or writes those of all commands into a folder.
pub(super) fn manual(folder: Option<&Path>) -> Result<Outcome, CliError> {
    let command = CommandLine::command();
    let Some(folder) = folder else {
        let mut text = Vec::new();
        // A vector takes everything.
        let _ = clap_mangen::Man::new(command).render(&mut text);
        return console::print(text).map(|()| Outcome::Done);
    };
    check_target(&folder.join("drt.1"))?;
    clap_mangen::generate_to(command, folder)
        .map_err(|e| CliError::Write { path: folder.into(), reason: e.to_string() })?;
    Ok(Outcome::Done)
}
