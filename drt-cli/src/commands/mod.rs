//! The commands of `drt`, from arguments to an exit code.

mod batch;
mod bench;
mod check;
mod clock;
mod console;
mod derivatives;
mod destinations;
mod fingerprint;
mod grad;
mod growing;
mod info;
mod loss_gradient;
mod markup;
mod merge;
mod monitor;
mod noise;
mod optimize;
mod options;
mod outputs;
mod preview;
mod render;
mod run;
mod shard;
mod shard_file;
mod shell;
mod stop;
mod table;
mod targets;
mod view;

use std::ffi::OsString;
use std::io::IsTerminal;

use clap::Parser;

use crate::CliError;
use crate::wording::{readable, shown};
use options::{Command, CommandLine};

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// All is done.
    Done,
    /// A check did not pass.
    Failed,
    /// Stopped by the user; what was finished is written.
    Interrupted,
    /// Failed with this exit code, of which another process tells.
    Silent(u8),
}

impl Outcome {
    fn exit_code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::Interrupted => stop::STOPPED,
            Self::Silent(code) => code,
        }
    }
}

/// How a command that has written a rendering ended.
fn noted(rendering: &drt_estimators::Rendering) -> Outcome {
    if rendering.complete { Outcome::Done } else { Outcome::Interrupted }
}

/// Runs the command line `args`, the first of which is the program's name, and returns its exit
/// code: 0 done, 1 a check failed, 2 unusable input or arguments, 3 failure while writing, 130
/// stopped by Ctrl-C or SIGTERM.
///
/// Errors are told in one message on the standard error.
pub fn main(args: impl IntoIterator<Item = OsString>) -> u8 {
    let line = match CommandLine::try_parse_from(args) {
        Ok(line) => line,
        Err(e) => return explain(&e),
    };
    stop::listen();
    told(dispatch(&line.command).map(Outcome::exit_code))
}

/// The exit code, with the error on the standard error if there is one.
fn told(result: Result<u8, CliError>) -> u8 {
    match result {
        Ok(code) => code,
        Err(e) => {
            console::note(format_args!("drt: error: {}", shown(&e.to_string())));
            e.exit_code()
        }
    }
}

/// Shows what is wrong with a command line, or the help that was asked for.
fn explain(e: &clap::Error) -> u8 {
    let code = e.exit_code() as u8;
    let text = e.to_string();
    match text.strip_prefix("error: ") {
        Some(text) if code != 0 => {
            let message = text.split("\n\nUsage:").next().unwrap_or(text);
            let message = readable(message.trim_end());
            console::note(format_args!("drt: error: {message}"));
        }
        _ if code != 0 => console::note(text.trim_end()),
        // Help, which is a result.
        _ => {
            let styled = std::io::stdout().is_terminal();
            let help = if styled { e.render().ansi().to_string() } else { text };
            return told(console::print(help).map(|()| code));
        }
    }
    code
}

fn dispatch(command: &Command) -> Result<Outcome, CliError> {
    match command {
        Command::Render(options) => render::run(options),
        Command::Grad(options) => grad::run(options),
        Command::Check(options) => check::run(options),
        Command::Info(options) => info::run(options),
        Command::Optimize(options) => optimize::run(options),
        Command::Bench(options) => bench::run(options),
        Command::Batch(options) => batch::run(options),
        Command::Merge(options) => merge::run(options),
        Command::Preview(options) => preview::run(options),
        Command::View(options) => view::run(options),
        Command::Completions { shell } => shell::completions(*shell),
        Command::Man { output } => shell::manual(output.as_deref()),
    }
}
