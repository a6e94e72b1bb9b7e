//! The result of a simulated comparison.

use rig_excite::ExciteError;
use rig_identify::IdentifyError;
use serde::Serialize;

/// Reasons why a robot cannot be simulated and identified.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The motion cannot be designed or run.
    #[error(transparent)]
    Excite(#[from] ExciteError),
    /// The recording cannot be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The recursion has too few places.
    #[error(
        "{robot} has {parameters} base parameters; the on-line estimator of this comparison takes {most} at most."
    )]
    TooManyParameters {
        /// Name of the robot.
        robot: String,
        /// Base parameters.
        parameters: usize,
        /// Places.
        most: usize,
    },
}

/// A simulated robot with its identifications.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulatedRobot {
    /// `rig-compare-simulated/1`
    pub schema: &'static str,
    /// Name.
    pub robot: String,
    /// Seed of motion and noise.
    pub seed: u64,
    /// Duration of the training motion, s.
    pub seconds: f64,
    /// Sample rate, Hz.
    pub rate: f64,
    /// Cut-off of the position filter, Hz.
    pub cutoff: f64,
    /// Rows of the differential model per second.
    pub rows_per_second: f64,
    /// Length of the windows of the integral model, s. A window starts every quarter of it.
    pub window: f64,
    /// Per joint, speed below which rows are left out, rad/s or m/s.
    pub min_speed: Vec<f64>,
    /// Condition number of the designed motion, scaled columns.
    pub condition_number: f64,
    /// The parameters with their true values.
    pub parameters: Vec<TrueParameter>,
    /// The identifications: off-line and on-line, each by the differential and the integral model.
    pub estimates: Vec<SimulatedEstimate>,
    /// By joint, the hold-out.
    pub holdout: Vec<Holdout>,
    /// Notes, sentences.
    pub notes: Vec<String>,
}

/// A base parameter of the simulated robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrueParameter {
    /// The combination in the notation of the literature.
    pub expression: String,
    /// ASCII
    pub unit: String,
    /// Value that was simulated, SI.
    pub truth: f64,
}

/// An identified value beside the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SimulatedValue {
    /// Value, SI.
    pub value: f64,
    /// Standard deviation; null if an on-line estimate has seen too few residuals.
    pub std: Option<f64>,
    /// True if the 95 % interval holds the truth; null without a standard deviation.
    pub covers: Option<bool>,
}

/// One identification.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulatedEstimate {
    /// "off-line" or "on-line".
    pub way: &'static str,
    /// "differential" or "integral".
    pub model: &'static str,
    /// By parameter; null if the motion does not show it.
    pub values: Vec<Option<SimulatedValue>>,
    /// Time and torque error of the parameters, as a share of the torque, while an on-line estimate converges.
    pub convergence: [Vec<f64>; 2],
    /// RMS torque error of the parameters on the training motion, as a share of the torque, over all joints.
    pub torque_error: f64,
}

/// A joint on the hold-out motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Holdout {
    /// Name of the joint.
    pub joint: String,
    /// "N·m" or "N".
    pub unit: &'static str,
    /// Share of the rows that the residuals count: those that are slow or near a reversal are left out.
    pub used: f64,
    /// RMS of the measured torque on these rows.
    pub torque_rms: f64,
    /// RMS of the residual by estimate, as a share of the torque.
    pub relative_error: Vec<f64>,
    /// The same of the true parameters: noise and the error of the filtered motion.
    pub relative_error_of_truth: f64,
    /// Time, measured torque and the torque predicted by the first estimate, for a figure; all rows.
    pub series: [Vec<f64>; 3],
}
