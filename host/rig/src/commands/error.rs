//! What went wrong, as one sentence.

use std::path::PathBuf;

use thiserror::Error;

use rig_data::DataError;
use rig_identify::IdentifyError;
use rig_link::LinkError;
use rig_model::robot::RobotError;
use rig_model::simulate::SimulateError;
use rig_output::WriteError;
use rig_plant::emulated::NameplateError;
use rig_report::ReportError;

/// Why a command did not do its work. Every text is a sentence for the person at the terminal.
#[derive(Debug, Error)]
pub enum CommandError {
    /// A file stands in the way.
    #[error("{} exists already; choose another name with --out, or give --force to replace it.", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// A folder that holds results.
    #[error("{} holds {file} of an earlier run; choose another folder with --out, or give --force to replace what is there.", folder.display())]
    Results {
        /// The folder.
        folder: PathBuf,
        /// The first of them.
        file: &'static str,
    },
    /// The robot description.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A recording.
    #[error(transparent)]
    Data(#[from] DataError),
    /// Identification.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Simulation.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The rig.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The rig's nameplate.
    #[error(transparent)]
    Nameplate(#[from] NameplateError),
    /// A report.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// An output file.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Data that contradict the description.
    #[error("{0}")]
    Implausible(String),
    /// Trajectory design.
    #[error(transparent)]
    Excite(#[from] rig_excite::ExciteError),
    /// The demonstration.
    #[error(transparent)]
    Demo(#[from] crate::demo::DemoError),
    /// Validation.
    #[error(transparent)]
    Validate(#[from] rig_validate::ValidateError),
    /// The gap workflow.
    #[error(transparent)]
    Diagnose(#[from] rig_diagnose::DiagnoseError),
    /// Simulation under voltage.
    #[error(transparent)]
    Replay(#[from] rig_diagnose::voltage::ReplayError),
    /// A joint that its voltage drives.
    #[error(transparent)]
    Voltage(#[from] rig_diagnose::voltage::DrivenError),
    /// Anything else that has its whole sentence.
    #[error("{0}")]
    Sentence(String),
}
