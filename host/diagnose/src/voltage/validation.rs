//! Validation of a joint by its motor voltage, without measured torque or current.
//!
//! The model runs freely from the first state of each recording (10 s at most, then it restarts). The loop is closed by
//! the recording's controller with the described supply; without one, the recorded voltage drives. The simulated
//! position is compared with the recorded one.

use serde::Serialize;

use crate::voltage::driven::{DrivenError, Followed, VoltageModel};
use crate::voltage::free_run::FreeRun;
use crate::voltage::sentences;
use rig_data::prepare::Recording;
use rig_model::robot::{Robot, VoltageController};

/// Drive of the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "by", rename_all = "snake_case")]
pub enum DrivenBy {
    /// The recording's controller, in the closed loop.
    Controller {
        /// The controller.
        controller: VoltageController,
    },
    /// The recorded voltage.
    RecordedVoltage,
}

/// One recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VoltageChecked {
    /// Name of the recording.
    pub recording: String,
    /// Rows.
    pub rows: usize,
    /// Drive of the model.
    pub driven: DrivenBy,
    /// Result of the free run, and its position errors.
    pub motion: FreeRun,
    /// s
    #[serde(skip)]
    pub t: Vec<f64>,
    /// rad or m
    #[serde(skip)]
    pub measured: Vec<f64>,
    /// rad or m; shorter if the run could not continue.
    #[serde(skip)]
    pub simulated: Vec<f64>,
}

/// The result; serialises to `validation.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VoltageValidation {
    /// `rig-validation/1`
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// Name of the joint.
    pub joint: String,
    /// `rad` or `m`
    pub position_unit: String,
    /// All recordings together.
    pub motion: FreeRun,
    /// One per recording.
    pub recordings: Vec<VoltageChecked>,
    /// Sentences.
    pub warnings: Vec<String>,
}

impl From<Followed> for VoltageChecked {
    fn from(followed: Followed) -> Self {
        Self {
            recording: followed.recording,
            rows: followed.t.len(),
            driven: match followed.controller {
                Some(controller) => DrivenBy::Controller { controller },
                None => DrivenBy::RecordedVoltage,
            },
            motion: followed.run,
            t: followed.t,
            measured: followed.measured,
            simulated: followed.simulated,
        }
    }
}

/// Checks the motion that `robot` predicts for recordings of a joint under voltage. Nothing is refitted.
///
/// # Errors
/// [`DrivenError`]: a description without the parameters of a voltage model, recordings without a voltage.
pub fn validate_voltage(
    robot: &Robot,
    recordings: &[&dyn Recording],
) -> Result<VoltageValidation, DrivenError> {
    let model = VoltageModel::of(robot)?;
    let (followed, motion) = model.follow(recordings)?;
    let recordings: Vec<VoltageChecked> = followed.into_iter().map(VoltageChecked::from).collect();
    let left_out = model.left_out.into_iter().map(sentences::left_out);
    let diverged = (recordings.iter()).filter_map(|own| sentences::diverged_alone(&own.motion));
    let joint = &robot.joints[0];
    Ok(VoltageValidation {
        schema: "rig-validation/1".into(),
        robot: robot.name.clone(),
        joint: joint.name.clone(),
        position_unit: joint.kind.units().0.to_owned(),
        motion,
        warnings: left_out.chain(diverged).collect(),
        recordings,
    })
}
