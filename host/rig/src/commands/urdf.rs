//! `rig urdf`: a description as URDF.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::error::CommandError;
use super::input::{RobotArg, described};
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_output::write_whole;

/// Writes a robot description as URDF, for simulators and other libraries, and says what URDF has no place for.
///
/// A TOML description becomes a file of bare links. With --into its values are put into a URDF of the same robot instead,
/// whose names, frames, meshes and comments stay as they are.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// URDF file of the same robot into which the values are put
    #[arg(long, value_name = "FILE")]
    into: Option<PathBuf>,
    /// File to write (.urdf)
    #[arg(long)]
    out: PathBuf,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

/// Runs the command.
///
/// # Errors
/// The description, a link without inertial parameters, or the file.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    refuse_file(&args.out, args.force)?;
    let description = args.robot.describe(ui)?;
    let robot = &description.robot;
    let into = args
        .into
        .as_deref()
        .map(|path| described(path, ui))
        .transpose()?;
    let original = match (&args.into, into) {
        (Some(path), Some(into)) => Some(into.urdf.ok_or_else(|| {
            CommandError::Sentence(format!(
                "{} is no URDF file, but --into names one whose values are replaced.",
                path.display()
            ))
        })?),
        _ => description.urdf,
    };
    let urdf = match &original {
        Some(original) => original.with_values(robot)?,
        None => robot.to_urdf()?,
    };
    write_whole(&args.out, urdf.text.as_bytes())?;
    for remark in &urdf.remarks {
        ui.remark(remark);
    }
    let what = match (&original, &args.into) {
        (Some(_), None) => "the URDF file as it was",
        (Some(_), Some(_)) => "the URDF file with the description's values",
        (None, _) => "link frames are the description's",
    };
    ui.say(&format!(
        "{}: {} joints; {what}.",
        args.out.display(),
        robot.joints.len()
    ));
    Ok(())
}
