//! The `rig` program.

use std::process::ExitCode;

use clap::Parser;
use rig::commands::{Cli, plain};

/// Exit status after wrong arguments.
const WRONG_ARGUMENTS: u8 = 2;

fn main() -> ExitCode {
    let words: Vec<String> = (std::env::args_os())
        .map(|word| word.to_string_lossy().into_owned())
        .collect();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => match Cli::wrong_arguments(&error, &words) {
            Some(text) => {
                eprintln!("rig: error: {text}");
                return ExitCode::from(WRONG_ARGUMENTS);
            }
            None => error.exit(),
        },
    };
    match cli.run() {
        Ok(status) => ExitCode::from(status),
        Err(error) => {
            eprintln!("rig: error: {}", plain(&error.to_string()));
            ExitCode::FAILURE
        }
    }
}
