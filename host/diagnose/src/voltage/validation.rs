//! Validation of a joint that is known by its motor voltage, where neither torque nor current was measured.
//!
//! The model runs freely from the first state of each recording (10 s at most, then anew): in the closed loop of the controller that
//! the recording shows, with the supply of the description, or under the recorded voltage where it shows none. Its position is
//! compared with the recorded one.

use serde::Serialize;

use crate::voltage::{DrivenError, Followed, FreeRun, VoltageModel};
use rig_data::prepare::Recording;
use rig_model::robot::{Robot, VoltageController};

/// What drives the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "by", rename_all = "snake_case")]
pub enum DrivenBy {
    /// The controller that the recording shows, in the closed loop.
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
    /// What drives the model.
    pub driven: DrivenBy,
    /// What became of the free run, and its position errors.
    pub motion: FreeRun,
    /// s
    #[serde(skip)]
    pub t: Vec<f64>,
    /// rad or m
    #[serde(skip)]
    pub measured: Vec<f64>,
    /// rad or m; shorter where the run could not go on.
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
    /// One a recording.
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
/// [`DrivenError`]: a description that does not state what a voltage makes of the joint, recordings without a voltage.
pub fn validate_voltage(
    robot: &Robot,
    recordings: &[&dyn Recording],
) -> Result<VoltageValidation, DrivenError> {
    let model = VoltageModel::of(robot)?;
    let (followed, motion) = model.follow(recordings)?;
    let recordings: Vec<VoltageChecked> = followed.into_iter().map(VoltageChecked::from).collect();
    let mut warnings = model.remarks;
    warnings.extend(recordings.iter().filter_map(diverged));
    let joint = &robot.joints[0];
    Ok(VoltageValidation {
        schema: "rig-validation/1".into(),
        robot: robot.name.clone(),
        joint: joint.name.clone(),
        position_unit: joint.kind.units().0.to_owned(),
        motion,
        recordings,
        warnings,
    })
}

/// Says where and why the run over a recording diverged, where it did.
fn diverged(checked: &VoltageChecked) -> Option<String> {
    let FreeRun::Diverged {
        recording,
        time,
        why,
    } = &checked.motion
    else {
        return None;
    };
    Some(format!(
        "{recording}: the free run diverges at {time:.2} s: {why}. Its errors say nothing of the model."
    ))
}
