//! The commands that make files: each is also a step of `rig run`.

use clap::{Args, CommandFactory, Parser, Subcommand};

use super::error::CommandError;
use super::ui::Ui;
use super::{
    compare, compliance, control, convert, diagnose, excite, friction_map, header, identify, init,
    inspect, load, mjcf, record, simulate, table, urdf, validate,
};

/// A command that makes files from files.
#[derive(Debug, Subcommand)]
pub(crate) enum Work {
    Init(init::Args),
    Inspect(inspect::Args),
    Excite(excite::Args),
    Record(record::Args),
    Simulate(simulate::Args),
    Convert(convert::Args),
    Urdf(urdf::Args),
    Mjcf(mjcf::Args),
    Header(header::Args),
    Identify(identify::Args),
    FrictionMap(friction_map::Args),
    Validate(validate::Args),
    Diagnose(diagnose::Args),
    Table(table::Args),
    Load(load::Args),
    Compare(compare::Args),
    Compliance(compliance::Args),
    Control(control::Args),
}

/// The words of such a command, as in `rig excite --robot arm.toml --out motion.toml`.
#[derive(Debug, Args)]
pub(crate) struct Words {
    #[command(subcommand)]
    pub(crate) work: Work,
}

impl CommandFactory for Words {
    fn command() -> clap::Command {
        with_negative_numbers(Self::augment_args(clap::Command::new("rig")))
    }

    fn command_for_update() -> clap::Command {
        Self::command()
    }
}

reads_poses!(Words);

/// Lets every option of a command and of its subcommands take a negative number, or a list that begins with one. The check
/// of the value then says what is possible, instead of clap that `-2` is no option.
pub(crate) fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let names: Vec<String> = (command.get_subcommands())
        .map(|own| own.get_name().to_owned())
        .collect();
    let command = command.mut_args(|own| match own.get_action().takes_values() {
        // A list is one word, and for clap no number.
        true if own.get_value_delimiter().is_some() => own.allow_hyphen_values(true),
        true if !own.is_positional() => own.allow_negative_numbers(true),
        _ => own,
    });
    names.into_iter().fold(command, |command, name| {
        command.mut_subcommand(name, with_negative_numbers)
    })
}

impl Work {
    /// Runs the command; returns the exit status.
    ///
    /// # Errors
    /// A sentence for the user.
    pub(crate) fn run(&self, ui: &Ui) -> Result<u8, CommandError> {
        match self {
            Self::Init(args) => init::run(args, ui),
            Self::Inspect(args) => inspect::run(args, ui),
            Self::Excite(args) => excite::run(args, ui),
            Self::Record(args) => record::run(args, ui),
            Self::Simulate(args) => simulate::run(args, ui),
            Self::Convert(args) => convert::run(args, ui),
            Self::Urdf(args) => urdf::run(args, ui),
            Self::Mjcf(args) => mjcf::run(args, ui),
            Self::Header(args) => header::run(args, ui),
            Self::Table(args) => table::run(args, ui),
            Self::Identify(args) => ui.with_json(args.json_file(), |ui| identify::run(args, ui)),
            Self::FrictionMap(args) => {
                ui.with_json(args.json_file(), |ui| friction_map::run(args, ui))
            }
            Self::Validate(args) => ui.with_json(args.json_file(), |ui| validate::run(args, ui)),
            Self::Diagnose(args) => {
                return ui.with_json(args.json_file(), |ui| diagnose::run(args, ui));
            }
            Self::Load(args) => ui.with_json(args.json_file(), |ui| load::run(args, ui)),
            Self::Compare(args) => ui.with_json(args.json_file(), |ui| compare::run(args, ui)),
            Self::Compliance(args) => {
                ui.with_json(args.json_file(), |ui| compliance::run(args, ui))
            }
            Self::Control(args) => ui.with_json(args.json_file(), |ui| control::run(args, ui)),
        }
        .map(|()| 0)
    }
}
