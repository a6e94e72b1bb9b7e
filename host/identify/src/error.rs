//! Reasons why an identification fails.

use rig_data::prepare::PrepareError;

/// Returns the advice for a recording with too few usable rows, by the main reason for the unusable ones.
fn what_helps(slow: u64, saturated: u64, unsettled: u64) -> &'static str {
    if unsettled > slow.max(saturated) {
        "record a slower motion, or with a higher supply voltage: the amplifier of the current then has time to settle"
    } else if saturated > slow {
        "the torque stands at its limit: record a motion that needs less, or without the limit"
    } else {
        "record a longer or livelier motion"
    }
}

/// Reasons why an identification fails.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// Reading or preparing a recording failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The robot has no valid model.
    #[error("The robot's model cannot be built: {0}")]
    Model(String),
    /// The base parameters are ambiguous.
    #[error(
        "The base parameters of {robot} cannot be decided: column {column} of joint `{joint}` is independent of the others by only {least:.1e} of its length; write lengths and angles of that joint and the one before it that are meant to be zero, or multiples of a right angle, exactly."
    )]
    Undecided {
        /// Name of the doubtful column.
        column: String,
        /// Its joint.
        joint: String,
        /// Relative length of the doubtful column after projection onto the others.
        least: f64,
        /// Name of the robot.
        robot: String,
    },
    /// No recording.
    #[error("No training recording was given; name at least one.")]
    NoRecording,
    /// Too few rows are usable after masking.
    #[error(
        "Of all rows only {used} are usable for {unknown} parameters (too slow: {slow}, saturated: {saturated}, current not settled: {unsettled}); {}.", what_helps(*slow, *saturated, *unsettled)
    )]
    NothingLeft {
        /// Usable rows.
        used: u64,
        /// Parameters.
        unknown: usize,
        /// Rows that were too slow.
        slow: u64,
        /// Rows at a torque limit.
        saturated: u64,
        /// Rows with a current that had not settled.
        unsettled: u64,
    },
    /// The torque is zero in all rows.
    #[error(
        "The torque of joint {joint} is zero throughout; record the torque or the motor current{}.", if *.still { ", or make the joint, which stands still, fixed in the description (type=\"fixed\" in a URDF)" } else { "" }
    )]
    NoTorque {
        /// Number of the joint, from 1.
        joint: usize,
        /// True if the joint stands still in all rows.
        still: bool,
    },
    /// The fit is singular.
    #[error(
        "The least-squares problem is singular although its columns looked independent; the smallest of them is {column}."
    )]
    Singular {
        /// Name of the smallest column.
        column: String,
    },
    /// The recording is too short for a confidence interval.
    #[error(
        "{rows} rows whose residuals are correlated over {memory:.0} rows are too few for a confidence interval; record at least {needed} s."
    )]
    TooShortForIntervals {
        /// Rows.
        rows: u64,
        /// Correlation time of the residuals, rows.
        memory: f64,
        /// Duration needed, s.
        needed: u64,
    },
    /// The window length is impossible for the integral model.
    #[error(
        "A window of {} s is not possible for the integral model; it must last between {least} s and {most} s here.",
        rig_model::robot::written(*window)
    )]
    Window {
        /// Requested length, s.
        window: f64,
        /// Shortest possible, s.
        least: f64,
        /// Longest possible, s.
        most: f64,
    },
    /// The physically consistent fit did not converge.
    #[error(
        "The physically consistent fit found no end: {why}. A prior uncertainty nearer to 1 (--prior-uncertainty) or a description nearer to the robot would help."
    )]
    Inconsistent {
        /// Reason.
        why: String,
    },
    /// An iteration did not converge.
    #[error(
        "{what} did not settle after {passes} steps; a longer recording or a prior closer to the robot would help."
    )]
    Unsettled {
        /// Name of the iteration.
        what: &'static str,
        /// Steps.
        passes: usize,
    },
    /// Output error was requested without a closed loop.
    #[error(
        "Estimator output-error simulates the closed loop: every joint needs a [joint.controller] in the description and a column ref<k> in every recording; use iv, which makes do with less."
    )]
    NoLoop,
    /// The recorded references do not match the motion.
    #[error(
        "Estimator output-error follows the recorded references (columns ref<k>), and these are in another unit or sense than the positions; correct them."
    )]
    StrangeReference,
    /// The identified model cannot be simulated.
    #[error("The identified model cannot be simulated: {0}")]
    Simulation(String),
    /// A recording's weight is out of range.
    #[error(
        "A recording's weight is {0}; it must lie between 1e-12 and 1e12 (1 counts the recording once, 2 twice)."
    )]
    Weight(f64),
    /// The prior uncertainty is not positive.
    #[error(
        "The description's relative uncertainty is given as {0}; it must be above zero (0.1 means 10 %)."
    )]
    PriorUncertainty(f64),
    /// A prior uncertainty was given for an estimator that uses no prior.
    #[error(
        "The description's relative uncertainty is given as {uncertainty}, but {estimator} of one joint takes nothing from the description; give --estimator ridge or consistent, or leave --prior-uncertainty out."
    )]
    UnusedUncertainty {
        /// The given uncertainty.
        uncertainty: f64,
        /// The estimator's name.
        estimator: &'static str,
    },
    /// A window was given for the differential model.
    #[error(
        "A window of {0} s is given, but the differential model has no windows; give --model integral, or leave --window out."
    )]
    UnusedWindow(f64),
    /// The friction map cannot be computed.
    #[error("{0}")]
    FrictionMap(String),
}

/// Returns the error for a singular matrix.
pub(crate) fn singular(what: &str) -> IdentifyError {
    IdentifyError::Singular {
        column: what.to_owned(),
    }
}

pub(crate) fn failed(e: impl std::fmt::Display) -> PrepareError {
    PrepareError::Stopped(e.to_string())
}
