//! Error of the benchmark.

use std::path::PathBuf;

use rig_diagnose::DiagnoseError;
use rig_output::WriteError;
use rig_scenario::ScenarioError;

/// Reason why the benchmark stopped.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A scenario cannot be made.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A method cannot process a recording.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The output folder holds results already.
    #[error(
        "{0} holds results of an earlier run; name another folder with --out, or replace them with --force."
    )]
    Results(PathBuf),
    /// An option is out of its range; a sentence.
    #[error("{0}")]
    Option(String),
}
