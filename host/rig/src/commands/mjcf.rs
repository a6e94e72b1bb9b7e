//! `rig mjcf`: the values of the joints for a model of MuJoCo.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::input::RobotArg;
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_output::write_whole;

/// Writes armature, damping, frictionloss and gear of each joint as a fragment of MJCF, for a model of MuJoCo.
///
/// The fragment has a class of defaults for each joint, named like the joint. Give the model <include file="joints.xml"/>
/// before its <worldbody>, and each joint class="NAME". Values that MJCF cannot hold are named. Inertias are not written: take
/// those of `rig urdf`.
///
/// A model of MuJoCo (.xml) is also read wherever --robot stands.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// File to write (.xml)
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
    let written = robot.to_mjcf_joints();
    write_whole(&args.out, written.text.as_bytes())?;
    for remark in &written.remarks {
        ui.warn(remark);
    }
    ui.file(&args.out);
    ui.fact("joints", robot.joints.len());
    ui.answer(&format!(
        "{}: {} joints",
        args.out.display(),
        robot.joints.len()
    ));
    Ok(())
}
