//! Reasons why a load cannot be identified.

use rig_data::prepare::PrepareError;
use rig_identify::IdentifyError;
use rig_model::robot::RobotError;

/// Reasons why a load cannot be identified.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The robot has axes that follow a joint.
    #[error(transparent)]
    Robot(#[from] Box<RobotError>),
    /// Reading or preparing a recording failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// Rows of the robot's model cannot be computed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The robot has no valid model.
    #[error("The robot's model cannot be built: {0}")]
    Model(String),
    /// A recording lacks columns of the wrist sensor.
    #[error(
        "{label} has no column `{column}`: a wrist sensor is recorded as fx fy fz (N) and mx my mz (N·m); correct the header, or give --by torque."
    )]
    NoColumn {
        /// Name of the recording.
        label: String,
        /// The first column that is missing.
        column: &'static str,
    },
    /// A value of the sensor's temperature is no number.
    #[error(
        "{label}:{line}: the column `temp` (temperature of the sensor) holds no finite number; give one in every row, or leave the column out."
    )]
    NoTemperature {
        /// Name of the recording.
        label: String,
        /// Line or message.
        line: u64,
    },
    /// A recording lacks joint torques.
    #[error("{label} has no joint torques (tau<k> or i<k>); record them, or give --by sensor.")]
    NoTorque {
        /// Name of the recording.
        label: String,
    },
    /// A channel of the sensor always reads the same.
    #[error(
        "{column} of {label} is {value} in every row: that channel is dead or was not recorded; check the sensor's cable and the recorder. A simulated sensor that carries nothing reads the same everywhere: simulate its noise (--noise-force, --noise-moment)."
    )]
    Dead {
        /// Name of the recording.
        label: String,
        /// Column.
        column: &'static str,
        /// Its value.
        value: f64,
    },
    /// Too little is known to estimate even the mass.
    #[error(
        "{rows} usable rows or poses are too few for a load with an unknown sensor bias; at least {least} are needed. `rig excite --load` designs a motion or poses."
    )]
    TooFew {
        /// Rows.
        rows: usize,
        /// Least number.
        least: usize,
    },
    /// A recording without poses at rest that is too short for a motion, or was called one of poses.
    #[error("{label} moves all the time, so its rows are no poses at rest: {remedy}.")]
    Moves {
        /// Name of the recording.
        label: String,
        /// What to do.
        remedy: String,
    },
    /// No joint moves.
    #[error(
        "The joints rest in these recordings, and friction hides the torque of a joint at rest; record a motion (`rig excite --load` designs one), or give --by sensor."
    )]
    AtRest,
    /// The data do not show the mass.
    #[error("The data do not show the mass of the load: {why}.")]
    NoMass {
        /// Reason, and what to record.
        why: String,
    },
    /// The readings cannot be right.
    #[error("{0} Nothing was written; give --even-if-wrong to identify the load in spite of this.")]
    Fault(String),
}
