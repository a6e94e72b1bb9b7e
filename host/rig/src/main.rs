//! The `rig` program.

use std::process::ExitCode;

use rig::commands::Cli;

fn main() -> ExitCode {
    match Cli::read(std::env::args_os())
        .unwrap_or_else(|error| error.exit())
        .run()
    {
        Ok(status) => ExitCode::from(status),
        Err(error) => {
            eprintln!("rig: {error}");
            ExitCode::FAILURE
        }
    }
}
