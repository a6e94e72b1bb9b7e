//! Results of the demonstration.

use rig_diagnose::Diagnosis;
use rig_identify::{FrictionMap, Identification};
use rig_link::{LossReport, RecordedRun};
use rig_model::robot::Robot;
use rig_plant::Equivalent;

/// Results of the demonstration.
pub struct Demo {
    /// Description that firmware and host were given.
    pub robot: Robot,
    /// True parameters of the emulated rig, with the link's true angle as coordinate.
    pub truth: Equivalent,
    /// Identification with the differential model.
    pub differential: Identification,
    /// Identification with the integral model.
    pub integral: Identification,
    /// Friction as a function of speed.
    pub friction_map: FrictionMap,
    /// Diagnosis of the identified description.
    pub diagnosis: Diagnosis,
    /// Identified description with the effects that were found.
    pub model: Robot,
    /// The training run, with its on-line estimates.
    pub training: RecordedRun,
    /// The hold-out run.
    pub holdout: RecordedRun,
    /// Slow reversals without precompensation.
    pub without: RecordedRun,
    /// Slow reversals with precompensation.
    pub with: RecordedRun,
    /// Lost samples of each run.
    pub losses: Vec<LossReport>,
    /// Sample rate of the telemetry, Hz.
    pub sample_rate: f64,
}
