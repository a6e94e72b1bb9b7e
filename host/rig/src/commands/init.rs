//! `rig init`: writes a commented robot description to start from.

use std::path::{Path, PathBuf};

use clap::{Args as ClapArgs, ValueEnum};

use super::chain_arg::ChainArg;
use super::error::CommandError;
use super::input::described;
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_model::robot::{self, ChainChoice, Origin};
use rig_output::write_whole;

/// Robots with a prepared description.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Kind {
    /// The one-link geared rig.
    OneLink,
    /// The planar direct-drive arm of the book, with representative values.
    Edda,
    /// The five-axis IRp-6 of the book, with its ball screws, absolute drives and coupled wrist.
    Irp6,
    /// The EMPS ball-screw axis whose public recordings the project reproduces.
    Emps,
    /// The Stäubli TX40 whose public recording, made on the motor side, the project reproduces.
    Tx40,
    /// The double pendulum of the DFKI whose public recordings the project reproduces.
    DoublePendulum,
    /// The pendulum on a Dynamixel XL330 servo whose public recordings have a voltage and no current.
    Xl330,
}

/// Writes a commented robot description to start from: an example, or the chain of a URDF file.
///
/// A description from a URDF has the same dynamics as the file. Acceleration limits, drives and controllers, which a URDF
/// does not state, are commented lines to fill in.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// Which robot
    #[arg(value_enum, required_unless_present = "from", conflicts_with = "from")]
    pub(crate) kind: Option<Kind>,
    /// URDF or MJCF file whose values the description gets
    #[arg(long, value_name = "FILE")]
    pub(crate) from: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) chain: ChainArg,
    /// File to write [default: the robot's name, or that of the URDF file, with .toml]
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
}

/// Runs the command.
///
/// # Errors
/// The file exists already or cannot be written.
pub(crate) fn run(args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let Some(kind) = args.kind else {
        return match &args.from {
            Some(from) => from_urdf(from, args, ui),
            None => Err(CommandError::Sentence(
                "Name a robot, or a URDF file with --from.".to_owned(),
            )),
        };
    };
    if args.chain.choice() != ChainChoice::default() {
        return Err(CommandError::Sentence(
            "--base, --tip and --lock choose a chain of a URDF file; give one with --from."
                .to_owned(),
        ));
    }
    let (name, text) = match kind {
        Kind::OneLink => ("one-link.toml", robot::ONE_LINK_TEMPLATE),
        Kind::Edda => ("edda.toml", robot::EDDA_TEMPLATE),
        Kind::Irp6 => ("irp6.toml", robot::IRP6_TEMPLATE),
        Kind::Emps => ("emps.toml", robot::EMPS),
        Kind::Tx40 => ("tx40.toml", robot::TX40),
        Kind::DoublePendulum => ("double-pendulum.toml", robot::DOUBLE_PENDULUM),
        Kind::Xl330 => ("xl330.toml", robot::XL330),
    };
    let path = args.out.clone().unwrap_or_else(|| PathBuf::from(name));
    refuse_file(&path, args.force)?;
    write_whole(&path, text.as_bytes())?;
    ui.file(&path);
    ui.answer(&format!(
        "{}: change the values that differ on your rig, then give the file to the other commands with --robot.",
        path.display()
    ));
    Ok(())
}

/// Writes the chain of a URDF or MJCF file as TOML.
fn from_urdf(from: &Path, args: &Args, ui: &Ui) -> Result<(), CommandError> {
    let name = from.with_extension("toml");
    let name = name
        .file_name()
        .map_or_else(|| PathBuf::from("robot.toml"), PathBuf::from);
    let path = args.out.clone().unwrap_or(name);
    refuse_file(&path, args.force)?;
    let description = described(from, &args.chain, ui)?;
    if description.robot.origin != Origin::Urdf {
        return Err(CommandError::Sentence(format!(
            "{} is a TOML description already; --from takes a URDF or MJCF file.",
            from.display()
        )));
    }
    let source = from
        .file_name()
        .unwrap_or(from.as_os_str())
        .to_string_lossy();
    let mut head = vec![
        format!(
            "The chain of {source} with its dynamics. Lines that begin with # hold what the file does not state:"
        ),
        "remove the # and write a value behind the = to use one.".to_owned(),
    ];
    head.extend(description.remarks.iter().cloned());
    let text = description.robot.to_toml_draft(&head)?;
    write_whole(&path, text.as_bytes())?;
    ui.file(&path);
    ui.fact("joints", description.robot.joints.len());
    ui.answer(&format!(
        "{}: {} joints; fill in the commented lines that you know, then give the file to the other commands with --robot.",
        path.display(),
        description.robot.joints.len()
    ));
    Ok(())
}
