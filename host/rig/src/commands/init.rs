//! `rig init`: writes a commented robot description to start from.

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::error::CommandError;
use super::overwrite::refuse_file;
use super::ui::Ui;
use rig_model::robot;
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

/// Writes a commented robot description to start from.
#[derive(Debug, ClapArgs)]
pub(crate) struct Args {
    /// Which robot
    #[arg(value_enum)]
    pub(crate) kind: Kind,
    /// File to write [default: the robot's name with .toml]
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
    let (name, text) = match args.kind {
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
    ui.say(&format!(
        "{}: change the values that differ on your rig, then give the file to the other commands with --robot.",
        path.display()
    ));
    Ok(())
}
