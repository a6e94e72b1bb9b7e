//! The result of a validation.

use serde::Serialize;

use rig_data::prepare::PreprocessingPlan;
use rig_identify::ResidualReport;

/// Predicted and measured torque of one joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorqueCheck {
    /// Name of the joint.
    pub joint: String,
    /// `N*m` or `N`
    pub unit: String,
    /// Residual and its statistics.
    #[serde(flatten)]
    pub residual: ResidualReport,
}

/// Simulated and measured motion of one joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionCheck {
    /// Name of the joint.
    pub joint: String,
    /// `rad` or `m`
    pub position_unit: String,
    /// `N*m` or `N`
    pub torque_unit: String,
    /// RMS of simulated minus measured position.
    pub position_rms_error: f64,
    /// Largest absolute value of this difference.
    pub position_max_error: f64,
    /// RMS error over the RMS of the measured position about its mean.
    pub position_relative_error: f64,
    /// RMS of the measured tracking error, reference minus position.
    pub tracking_rms: f64,
    /// RMS error over the RMS of the tracking error: a controller hides model errors in the position, but not in this
    /// ratio.
    pub tracking_relative_error: f64,
    /// RMS of simulated minus measured torque.
    pub torque_rms_error: f64,
    /// Largest absolute value of this difference.
    pub torque_max_error: f64,
    /// RMS error over the RMS of the measured torque.
    pub torque_relative_error: f64,
    /// Number of samples at which the torque limit acts on the simulated controller.
    pub saturated: u64,
    /// RMS change of the simulated position when the step is halved.
    pub position_step_change: f64,
    /// RMS change of the simulated torque when the step is halved.
    pub torque_step_change: f64,
    /// Curves for a plot.
    #[serde(skip)]
    pub series: MotionSeries,
}

/// Curves for a plot, at most 4000 points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionSeries {
    /// Time, s.
    pub t: Vec<f64>,
    /// Reference position.
    pub reference: Vec<f64>,
    /// Measured position.
    pub measured: Vec<f64>,
    /// Simulated position.
    pub simulated: Vec<f64>,
    /// Measured torque.
    pub torque_measured: Vec<f64>,
    /// Simulated torque.
    pub torque_simulated: Vec<f64>,
}

/// Simulated motion, or the reason why it is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Motion {
    /// Simulated and compared.
    Simulated {
        /// One entry per joint.
        joints: Vec<MotionCheck>,
        /// Number of simulated samples.
        samples: u64,
        /// Number of samples of the recording.
        of: u64,
        /// Stretches without a gap in time, each with its own initial state.
        stretches: usize,
        /// Simulation steps per sample.
        substeps: u32,
        /// Joints without a described controller. If there are any, the recorded torques drive the model instead of a
        /// closed loop.
        uncontrolled: Vec<String>,
        /// Sentences: input of the simulation, initial state, step, added torque, omissions.
        remarks: Vec<String>,
    },
    /// Not simulated.
    NotSimulated {
        /// Reason, a sentence.
        why: String,
    },
}

/// Results for one recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Checked {
    /// Name of the recording.
    pub recording: String,
    /// Number of rows.
    pub rows: u64,
    /// Sample rate, Hz.
    pub sample_rate: f64,
    /// One entry per joint.
    pub torque: Vec<TorqueCheck>,
    /// The closed loop.
    pub motion: Motion,
}

/// The result; serialises to `validation.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Validation {
    /// `rig-validation/1`
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// One entry per recording.
    pub recordings: Vec<Checked>,
    /// Sentences.
    pub warnings: Vec<String>,
    /// Effects of the description that were subtracted from the recordings, a sentence; none without such effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taken_off: Option<String>,
    /// Treatment of the recordings for the torque check.
    #[serde(skip)]
    pub treatment: PreprocessingPlan,
}
