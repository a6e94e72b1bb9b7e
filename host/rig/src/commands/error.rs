//! Errors of the commands, each one sentence.

use std::path::PathBuf;

use thiserror::Error;

use rig_data::DataError;
use rig_identify::IdentifyError;
use rig_link::LinkError;
use rig_load::LoadError;
use rig_model::robot::{Place, RobotError};
use rig_model::simulate::SimulateError;
use rig_output::WriteError;
use rig_plant::emulated::NameplateError;
use rig_report::ReportError;

/// Reason why a command failed. Every text is a sentence for the user.
#[derive(Debug, Error)]
pub enum CommandError {
    /// The output file exists already.
    #[error("{} exists already; choose another name with --out, or give --force to replace it.", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The output folder holds results already.
    #[error("{} holds {file} of an earlier run; choose another folder with --out, or give --force to replace what is there.", folder.display())]
    Results {
        /// The folder.
        folder: PathBuf,
        /// The first result found in it.
        file: &'static str,
    },
    /// The robot description.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A recording.
    #[error(transparent)]
    Data(#[from] DataError),
    /// Stiffness and compliance.
    #[error(transparent)]
    Compliance(#[from] rig_compliance::ComplianceError),
    /// Identification of a load.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// Comparison of results.
    #[error(transparent)]
    Compare(#[from] rig_compare::CompareError),
    /// A simulated comparison.
    #[error(transparent)]
    SimulatedComparison(#[from] rig_compare::SimulationError),
    /// Identification.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Control laws.
    #[error(transparent)]
    Control(#[from] rig_control::ControlError),
    /// Simulation.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The rig.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The live view.
    #[error(transparent)]
    Live(#[from] rig_live::LiveError),
    /// The rig's nameplate.
    #[error(transparent)]
    Nameplate(#[from] NameplateError),
    /// A report.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// An output file.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Data or results that contradict the description or physics.
    #[error("{0}")]
    Implausible(String),
    /// Trajectory design.
    #[error(transparent)]
    Excite(#[from] rig_excite::ExciteError),
    /// A value of the description that leaves no motion.
    #[error("{}:{place}: {error}", path.display())]
    Described {
        /// The description.
        path: PathBuf,
        /// Where the value stands.
        place: Place,
        /// Why it leaves none.
        error: Box<rig_excite::ExciteError>,
    },
    /// The demonstration.
    #[error(transparent)]
    Demo(#[from] crate::demo::DemoError),
    /// Validation.
    #[error(transparent)]
    Validate(#[from] rig_validate::ValidateError),
    /// The gap workflow.
    #[error(transparent)]
    Diagnose(#[from] rig_diagnose::DiagnoseError),
    /// Simulation of a joint under motor voltage.
    #[error(transparent)]
    Replay(#[from] rig_diagnose::voltage::ReplayError),
    /// A joint that is known by its motor voltage.
    #[error(transparent)]
    Voltage(#[from] rig_diagnose::voltage::DrivenError),
    /// Any other error, as a whole sentence.
    #[error("{0}")]
    Sentence(String),
}
