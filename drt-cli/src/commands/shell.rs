//! What a shell wants to know of the command line: completions and manual pages.

use std::path::Path;

use clap::CommandFactory;

use super::Outcome;
use super::console;
use super::options::CommandLine;
use crate::{CliError, write_atomically};

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
    let mut command = command.disable_help_subcommand(true);
    command.build();
    pages(&command, folder)?;
    Ok(Outcome::Done)
}

/// Writes the pages of a command and of all in it.
fn pages(command: &clap::Command, folder: &Path) -> Result<(), CliError> {
    let page = clap_mangen::Man::new(command.clone());
    write_atomically(&folder.join(page.get_filename()), |out| Ok(page.render(out)?))?;
    command.get_subcommands().try_for_each(|inner| pages(inner, folder))
}
