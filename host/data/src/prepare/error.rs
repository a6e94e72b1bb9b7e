//! Reasons for which a recording cannot be prepared.

use super::spacing::LONGEST_STEP;
use rig_output::format_short;

/// Why a recording cannot be prepared.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// The reader of the recording failed; its own sentence.
    #[error("{0}")]
    Read(String),
    /// Too few rows.
    #[error(
        "{label} has {rows} rows; at least {needed} are needed. Record for longer, or keep more of the rows (`rig identify`: a lower --decimation, a higher --cutoff)."
    )]
    TooShort {
        /// The recording.
        label: String,
        /// Rows it has.
        rows: u64,
        /// Rows that are needed.
        needed: u64,
    },
    /// Too few rows between one gap in time and the next.
    #[error(
        "{label} has gaps in time: the longest stretch without one holds {longest} of its {rows} rows; at least {needed} are needed. Record it again so that fewer rows are lost, or keep more of the rows (`rig identify`: a lower --decimation, a higher --cutoff)."
    )]
    Broken {
        /// The recording.
        label: String,
        /// Rows of its longest stretch.
        longest: u64,
        /// Rows it has.
        rows: u64,
        /// Rows that are needed in one stretch.
        needed: u64,
    },
    /// The rows are not evenly spaced in time.
    #[error(
        "{label} is not evenly sampled: near line {line} its steps in time are unlike the usual {mean:.6} s, the longest is {longest:.6} s; rows more than {} usual steps apart are not interpolated, so record or resample it at a constant rate.",
        LONGEST_STEP
    )]
    Irregular {
        /// The recording.
        label: String,
        /// Line of the file.
        line: u64,
        /// Usual step, s.
        mean: f64,
        /// Longest step, s.
        longest: f64,
    },
    /// Every joint stands still throughout.
    #[error(
        "Joint {joint} does not move in {label}: its position stays at {}, and no other joint moves; record a motion.",
        format_short(*position)
    )]
    NotMoving {
        /// The recording.
        label: String,
        /// Number of the first joint, from 1.
        joint: usize,
        /// Its position.
        position: f64,
    },
    /// The recordings have different rates.
    #[error(
        "{label} is sampled at {} Hz and the first recording at {} Hz; recordings that are identified together must have one rate.",
        format_short(*rate),
        format_short(*first)
    )]
    RateMismatch {
        /// The recording.
        label: String,
        /// Its rate, Hz.
        rate: f64,
        /// Rate of the first, Hz.
        first: f64,
    },
    /// A hold-out whose rate cannot hold the band of the fit.
    #[error(
        "{label} is sampled at {rate:.1} Hz and can be judged up to {most:.1} Hz only; the fit's band reaches to {band:.1} Hz. Record the hold-out faster (`rig identify` can also fit in a lower band, with --decimation)."
    )]
    BandBeyondRate {
        /// The recording.
        label: String,
        /// Its rate, Hz.
        rate: f64,
        /// Highest band at that rate, Hz.
        most: f64,
        /// Band of the fit, Hz.
        band: f64,
    },
    /// The number of joints differs.
    #[error("{label} has columns for {found} joints and the robot has {expected}.")]
    JointCount {
        /// The recording.
        label: String,
        /// Joints in the recording.
        found: usize,
        /// Joints of the robot.
        expected: usize,
    },
    /// A cut-off outside the possible range.
    #[error(
        "A cut-off of {} Hz is not possible at {} Hz; it must lie between 0 and {} Hz.",
        rig_model::robot::written(*cutoff),
        format_short(*rate),
        format_short(*nyquist)
    )]
    Cutoff {
        /// Asked for, Hz.
        cutoff: f64,
        /// Sample rate, Hz.
        rate: f64,
        /// Half of it, Hz.
        nyquist: f64,
    },
    /// A decimation that leaves too few rows.
    #[error(
        "Decimation by {factor} is not possible for {rows} rows; it must lie between 1 and {most}."
    )]
    Decimation {
        /// Asked for.
        factor: usize,
        /// Rows of the shortest recording.
        rows: u64,
        /// Highest possible.
        most: u64,
    },
    /// Measured derivatives were requested but are not in the recording.
    #[error(
        "{label} has no column {column}; record it or let the derivative be taken from the position."
    )]
    NoDerivative {
        /// The recording.
        label: String,
        /// Missing column.
        column: String,
    },
    /// The consumer of the rows failed; its own sentence.
    #[error("{0}")]
    Stopped(String),
}
