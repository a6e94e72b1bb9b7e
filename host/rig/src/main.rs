//! The `rig` program.

use std::process::ExitCode;

use rig::commands::Cli;

fn main() -> ExitCode {
    match Cli::from_arguments().run() {
        Ok(status) => ExitCode::from(status),
        Err(error) => {
            eprintln!("rig: {error}");
            ExitCode::FAILURE
        }
    }
}
