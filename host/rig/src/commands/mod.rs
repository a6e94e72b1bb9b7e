//! The commands of the program, one file each: read the arguments, call the library, report the results.
//!
//! The Python package (`host/python`) shares their checks of recordings and the writing of results.

/// Implements [`Parser`] for a command line in which `--pose` takes several values.
macro_rules! reads_poses {
    ($words:ty) => {
        impl Parser for $words {
            fn parse() -> Self {
                Self::parse_from(std::env::args_os())
            }

            fn try_parse() -> Result<Self, clap::Error> {
                Self::try_parse_from(std::env::args_os())
            }

            fn parse_from<I, T>(words: I) -> Self
            where
                I: IntoIterator<Item = T>,
                T: Into<std::ffi::OsString> + Clone,
            {
                Self::try_parse_from(words).unwrap_or_else(|error| error.exit())
            }

            fn try_parse_from<I, T>(words: I) -> Result<Self, clap::Error>
            where
                I: IntoIterator<Item = T>,
                T: Into<std::ffi::OsString> + Clone,
            {
                let words = $crate::commands::pose_arg::with_poses_joined(words);
                let mut matches = Self::command().try_get_matches_from(words)?;
                <Self as clap::FromArgMatches>::from_arg_matches_mut(&mut matches)
                    .map_err(|error| error.format(&mut Self::command()))
            }
        }
    };
}

mod audit;
mod base;
mod board;
mod chain_arg;
mod compare;
mod completions;
mod compliance;
mod control;
mod convert;
mod demo;
mod diagnose;
mod doctor;
mod error;
mod examples;
mod excite;
mod flash;
mod friction_map;
mod header;
mod identify;
mod init;
mod input;
mod inspect;
mod interrupts;
mod link_numbers;
mod live;
mod load;
mod man;
mod map_arg;
mod mjcf;
mod overwrite;
mod pictures;
mod pose_arg;
mod record;
mod report_arg;
mod run;
mod same_file;
mod simulate;
mod table;
mod ui;
mod urdf;
mod usage;
mod validate;
mod work;

use clap::{Args, CommandFactory, Parser, Subcommand};

pub use diagnose::write_diagnosis;
pub use error::CommandError;
use examples::with_examples;
pub use identify::{Compare, Impossible, write_identification};
pub use input::{Faults, Inputs, Watched, recordings, refuse_shared, refuse_twice};
pub use load::{LoadRequest, Measured, ReadsArg, load_json, write_load};
pub use overwrite::{refuse_file, refuse_folder};
pub use ui::plain;
use ui::{Ui, Wanted};
use work::{Work, with_negative_numbers};

/// Identifies a robot's dynamics and friction: record, identify, validate, diagnose, compensate.
///
/// Without a command it runs the demonstration (`rig demo`), which needs no hardware.
#[derive(Debug, Args)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Print errors alone, and what --json asks for
    #[arg(long, global = true)]
    quiet: bool,
    /// Print details, too: of a designed motion, of a fit, and all sentences of a diagnosis
    #[arg(long, global = true, conflicts_with = "quiet")]
    verbose: bool,
    /// Print the result as JSON instead of sentences
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Args),
    Run(run::Args),
    #[command(flatten)]
    Work(Work),
    Live(live::Args),
    Board(board::Args),
    Flash(flash::Args),
    Base(base::Args),
    Doctor(doctor::Args),
    Completions(completions::Args),
    Man(man::Args),
}

impl CommandFactory for Cli {
    fn command() -> clap::Command {
        let program = clap::Command::new("rig").version(env!("CARGO_PKG_VERSION"));
        with_examples(with_negative_numbers(Self::augment_args(program)))
    }

    fn command_for_update() -> clap::Command {
        Self::command()
    }
}

reads_poses!(Cli);

impl Cli {
    /// Returns what is wrong with the arguments `words` and what would be right, one line; `None` if `error` is that the user
    /// asked for help or the version.
    pub fn wrong_arguments(error: &clap::Error, words: &[String]) -> Option<String> {
        usage::wrong_arguments(error, words, &Self::command())
    }

    /// Runs the command; returns the exit status.
    ///
    /// # Errors
    /// A sentence for the user.
    pub fn run(self) -> Result<u8, CommandError> {
        let ui = Ui::new(Wanted {
            quiet: self.quiet,
            verbose: self.verbose,
            json: self.json,
        });
        let command = (self.command).unwrap_or_else(|| Command::Demo(demo::Args::default()));
        let status = command.run(&ui)?;
        if self.json {
            ui.print_summary();
        }
        Ok(status)
    }
}

impl Command {
    fn run(self, ui: &Ui) -> Result<u8, CommandError> {
        match self {
            Self::Demo(args) => demo::run(&args, ui),
            Self::Run(args) => return run::run(&args, ui),
            Self::Work(work) => return work.run(ui),
            Self::Live(args) => live::run(&args, ui),
            Self::Board(args) => board::run(&args, ui),
            Self::Flash(args) => flash::run(&args, ui),
            Self::Doctor(args) => return doctor::run(&args, ui),
            Self::Base(args) => base::run(&args, ui),
            Self::Man(args) => man::run(&args, Cli::command(), ui),
            Self::Completions(args) => {
                completions::run(&args, &mut Cli::command(), ui);
                Ok(())
            }
        }
        .map(|()| 0)
    }
}
