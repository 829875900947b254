//! The `drt` command; everything it does is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(drt_cli::commands::main(std::env::args_os()))
}
