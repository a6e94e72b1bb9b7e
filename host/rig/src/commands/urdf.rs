//! `rig urdf`: writes a description as URDF.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::audit;
use super::error::CommandError;
use super::input::{RobotArg, described};
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_output::write_whole;

/// Writes a robot description as URDF for simulators and other libraries, or checks the values of a URDF (--audit).
///
/// Values that URDF cannot hold are named.
///
/// A TOML description becomes a file of links without meshes. With --into its values are written into a copy of another
/// URDF of the same robot; names, frames, meshes and comments of that file stay unchanged.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    #[command(flatten)]
    robot: RobotArg,
    /// URDF file of the same robot whose copy gets the values
    #[arg(long, value_name = "FILE")]
    into: Option<PathBuf>,
    /// File to write (.urdf)
    #[arg(long, required_unless_present = "audit", conflicts_with = "audit")]
    out: Option<PathBuf>,
    /// Check the values of the URDF instead: masses, inertias, shapes, limits, the inertia matrix; writes nothing
    #[arg(long, conflicts_with = "into")]
    audit: bool,
    /// Seed of the poses at which the inertia matrix is checked (--audit)
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

/// Runs the command.
///
/// # Errors
/// The description is wrong, a link has no inertial parameters, or the file cannot be written.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let (false, Some(out)) = (args.audit, &args.out) else {
        let choice = args.robot.chain().choice();
        return audit::run(args.robot.path(), &choice, args.seed, ui);
    };
    refuse_file(out, args.force)?;
    let description = match args.into {
        Some(_) => args.robot.describe_for_another(ui)?,
        None => args.robot.describe(ui)?,
    };
    let robot = &description.robot;
    let into = args
        .into
        .as_deref()
        .map(|path| described(path, args.robot.chain(), ui))
        .transpose()?;
    let original = match (&args.into, into) {
        (Some(path), Some(into)) => Some(into.urdf.ok_or_else(|| {
            CommandError::Sentence(format!(
                "{} is not a URDF file; --into takes a URDF file whose values are replaced in the copy.",
                path.display()
            ))
        })?),
        _ => description.urdf,
    };
    let urdf = match &original {
        Some(original) => original.with_values(robot)?,
        None => robot.to_urdf()?,
    };
    write_whole(out, urdf.text.as_bytes())?;
    for remark in &urdf.remarks {
        ui.warn(remark);
    }
    let what = match (&original, &args.into) {
        (Some(_), None) => "the unchanged URDF file",
        (Some(_), Some(_)) => "the URDF file with the description's values",
        (None, _) => "the link frames are those of the description",
    };
    ui.file(out);
    ui.fact("joints", robot.joints.len());
    ui.answer(&format!(
        "{}: {} joints; {what}.",
        out.display(),
        robot.joints.len()
    ));
    Ok(())
}
