//! `rig validate`: a description against data that it was not made from.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::input::{Inputs, RobotArg, command_line};
use super::ui::Ui;
use crate::files::{folder, write_whole};
use crate::pages::{self, Context};
use crate::report;
use crate::validate::{Options, validate};

/// Predicts torque and simulates motion on data not used before.
///
/// Writes validation.json and report.html into the folder given with --out.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// Recording to judge by, CSV or MCAP; may be given several times
    #[arg(long, required = true)]
    data: Vec<PathBuf>,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A sentence naming the file, line or value at fault.
pub fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let robot = args.robot.load()?;
    let inputs = Inputs::open(&robot, &args.data)?;
    for warning in inputs.warnings() {
        ui.remark(&warning);
    }
    folder(&args.out)?;
    let mut progress = ui.progress("validating", 1000);
    let validation = validate(&robot, &inputs.recordings(), &Options::default(), &mut |share| {
        progress.at((1000.0 * share) as u64);
    })?;
    drop(progress);
    let context =
        Context { command: command_line(), warnings: inputs.warnings().collect(), ..Context::default() };
    let json = serde_json::to_string_pretty(&validation)
        .map_err(|error| CommandError::Sentence(format!("The result cannot be written as JSON: {error}.")))?;
    write_whole(&args.out.join("validation.json"), (json + "\n").as_bytes())?;
    report::write(&args.out.join("report.html"), &pages::validation(&robot, &validation, &context))?;
    for line in validation.summary() {
        ui.say(&line);
    }
    ui.say(&format!("report: {}", args.out.join("report.html").display()));
    Ok(())
}
