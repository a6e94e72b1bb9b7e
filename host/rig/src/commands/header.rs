//! `rig header`: friction and effects of a description as a C header.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::input::RobotArg;
use super::overwrite::refuse_file;
use super::ui::Ui;
use crate::c_header::c_header;
use rig_output::write_whole;

/// Writes friction and effects of a description as a C header, for controllers that are not written in Rust.
///
/// For each joint the header has `rig_joint<k>_torque`: Coulomb and viscous friction, the constant torque and the effects
/// that are torques. It is C99, in float (double with RIG_DOUBLE defined), and needs math.h alone. Effects on readings,
/// voltages, or between motor and link are not in it; each is named.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// File to write, such as friction.h
    #[arg(long)]
    out: PathBuf,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

/// Runs the command.
///
/// # Errors
/// The description is wrong, or the file cannot be written.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    refuse_file(&args.out, args.force)?;
    let robot = args.robot.load(ui)?;
    let from = args.robot.path().file_name().unwrap_or_default();
    let header = c_header(&robot, &from.to_string_lossy());
    write_whole(&args.out, header.text.as_bytes())?;
    for sentence in &header.left_out {
        ui.warn(sentence);
    }
    ui.file(&args.out);
    ui.answer(&format!(
        "{}: friction of {}",
        args.out.display(),
        header.holds.join(", ")
    ));
    Ok(())
}
