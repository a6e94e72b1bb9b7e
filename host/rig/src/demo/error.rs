//! Reasons why the demonstration failed.

use thiserror::Error;

use rig_data::DataError;
use rig_diagnose::DiagnoseError;
use rig_excite::ExciteError;
use rig_identify::IdentifyError;
use rig_link::{LinkError, RunError};
use rig_model::robot::RobotError;
use rig_model::simulate::SimulateError;
use rig_output::WriteError;
use rig_plant::emulated::NameplateError;

/// Reason why the demonstration failed.
#[derive(Debug, Error)]
pub enum DemoError {
    /// The description.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The nameplate that is sent to the firmware.
    #[error(transparent)]
    Nameplate(#[from] NameplateError),
    /// Trajectory design.
    #[error(transparent)]
    Excite(#[from] ExciteError),
    /// The link.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// An experiment.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Recordings.
    #[error(transparent)]
    Data(#[from] DataError),
    /// Identification.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Diagnosis.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// The model for a figure.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Files.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A fault of the rig.
    #[error("{0}")]
    Sentence(String),
}
