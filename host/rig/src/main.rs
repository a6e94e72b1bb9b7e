//! The `rig` program.

use std::process::ExitCode;

use clap::Parser;
use rig::commands::{Cli, plain};

fn main() -> ExitCode {
    match Cli::parse().run() {
        Ok(status) => ExitCode::from(status),
        Err(error) => {
            eprintln!("rig: error: {}", plain(&error.to_string()));
            ExitCode::FAILURE
        }
    }
}
