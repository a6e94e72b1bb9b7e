//! `rig urdf`: a description as URDF.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::input::RobotArg;
use super::ui::Ui;
use crate::files::write_whole;

/// Writes a robot description as URDF, for simulators and other libraries, and says what URDF has no place for.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// File to write (.urdf)
    #[arg(long)]
    out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// The description, a link without inertial parameters, or the file.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let robot = args.robot.load()?;
    let urdf = robot.to_urdf()?;
    write_whole(&args.out, urdf.text.as_bytes())?;
    for remark in &urdf.remarks {
        ui.remark(remark);
    }
    ui.say(&format!(
        "{}: {} joints.",
        args.out.display(),
        robot.joints.len()
    ));
    Ok(())
}
