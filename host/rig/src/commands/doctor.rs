//! `rig doctor`: what of this computer the program can use.

mod facts;
mod findings;

use std::path::PathBuf;

use clap::Args as ClapArgs;

use self::facts::Facts;
use self::findings::{Finding, State, findings};
use super::error::CommandError;
use super::ui::Ui;

/// Exit status if something is there that cannot be used; 1 and 2 are errors.
const FAULT: u8 = 10;

/// Checks what the program needs of this computer: serial ports, debug probe, compiler, Python package, recordings.
///
/// Each line is a finding: `ok`, `note` (something optional is not there) or `fault` (something is there and cannot be
/// used), with the command that mends it. Nothing is changed, and no port is opened. The exit status is 10 if there is a
/// fault, else 0.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// Folder in place of /, with dev/ and etc/: for tests
    #[arg(long, hide = true, default_value = "/")]
    root: PathBuf,
}

/// Runs the command; returns the exit status.
///
/// # Errors
/// Findings that cannot be written as JSON.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<u8, CommandError> {
    let found = findings(&Facts::gather(&args.root, std::env::var_os("RIG_DATA")));
    let faults = found.iter().filter(|own| own.state == State::Fault).count();
    if ui.is_json() {
        let result = serde_json::json!({
            "schema": "rig-doctor/1",
            "version": env!("CARGO_PKG_VERSION"),
            "faults": faults,
            "findings": found,
        });
        ui.print_json(&format!("{result:#}"));
    } else {
        for own in &found {
            ui.say(&line(own));
        }
    }
    Ok(if faults > 0 { FAULT } else { 0 })
}

/// Returns a finding as a line.
fn line(own: &Finding) -> String {
    let state = match own.state {
        State::Ok => "ok",
        State::Note => "note",
        State::Fault => "fault",
    };
    match &own.command {
        Some(command) => format!("{state:<5}  {}: {}: `{command}`", own.about, own.text),
        None => format!("{state:<5}  {}: {}.", own.about, own.text),
    }
}
