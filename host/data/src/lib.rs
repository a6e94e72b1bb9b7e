//! Recordings: columns with units, checked line by line and read in blocks of constant memory.
//!
//! [`Source`] reads CSV and MCAP repeatedly; [`RecordingWriter`] writes both. [`plausibility`] detects wrong units
//! before they lead to wrong parameters. [`prepare`] filters, differentiates and decimates recordings. [`runs`] holds
//! them in memory at the full rate, and [`Compensated`] subtracts the torques that a description already explains.
//!
//! ```no_run
//! use rig_data::Source;
//! use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())?;
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("log.csv");
//! let rows: String = (0..500).map(|k| format!("{},{},0.1\n", 0.001 * k as f64, 0.01 * k as f64)).collect();
//! std::fs::write(&path, format!("t,q1,tau1\n{rows}"))?;
//! let (blocks, warnings) = Source::open(&path, &robot)?.read_all()?;
//! assert_eq!(blocks[0].joints[0].q.len(), 500);
//! assert!(warnings.is_empty());
//! # Ok(())
//! # }
//! ```

mod bursts;
mod columns;
mod compensated;
mod csv;
mod csv_header;
mod error;
mod foreign;
mod held;
mod joint_states;
mod json_samples;
mod jump;
mod mcap_records;
mod mcap_rows;
mod motors;
mod number;
pub mod past;
mod place;
mod plausibility;
pub mod prepare;
mod quantity;
mod rate_spike;
mod reference;
mod remark;
mod ros_layout;
mod ros_message;
pub mod runs;
mod source;
mod spike;
mod unsigned;
mod writer;

pub use columns::EffortNeed;
pub use compensated::Compensated;
pub use error::{DataError, Warning};
pub use foreign::ForeignFormat;
pub use jump::jumps;
pub use place::Place;
pub use plausibility::{Implausible, plausibility, strange_rates};
pub use plausibility::{unit_of_steps, velocity_scale};
pub use quantity::Quantity;
pub use reference::reference_scale;
pub use reference::{StrangeReference, strange_references};
pub use remark::Remark;
pub use source::{Blocks, KEPT_WARNINGS, Sampling, Source};
pub use writer::{Column, CsvWriter, McapWriter, RecordingWriter};

use rig_model::simulate::Motion;

/// Number of rows at the start by which the columns are checked: a wrong unit or direction shows from the start.
pub const JUDGED_ROWS: usize = 100_000;

/// Source of the effort (torque or force) of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffortKind {
    /// Joint-side torque or force, column `tau<k>`.
    Torque,
    /// Motor current, column `i<k>`, converted with the drives' torque constants and ratios.
    Current,
}

/// Columns of one joint over a stretch of rows: equal length, SI units, joint side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointColumns {
    /// Position, rad or m (from `q<k>`, or from `qm<k>` of the motors through the drives).
    pub q: Vec<f64>,
    /// Joint torque or force, N·m or N (from `tau<k>`, or from `taum<k>` or `i<k>` of the motors through the drives).
    /// Empty if the recording has neither and was opened with [`EffortNeed::Optional`].
    pub tau: Vec<f64>,
    /// Measured velocity, if recorded.
    pub qd: Option<Vec<f64>>,
    /// Measured acceleration, if recorded.
    pub qdd: Option<Vec<f64>>,
    /// Reference position, if recorded.
    pub reference: Option<Vec<f64>>,
    /// Motor voltage, if recorded (`u<k>`, or `duty<k>` times `supply`), V.
    pub voltage: Option<Vec<f64>>,
    /// Temperature, if recorded, °C.
    pub temperature: Option<Vec<f64>>,
    /// Reading of an encoder on the link side of the transmission, if recorded (`ql<k>`), rad or m; any zero.
    pub link: Option<Vec<f64>>,
    /// Torque of the described effects, N·m or N; not from a file but from [`crate::Compensated`].
    pub effects: Option<Vec<f64>>,
}

/// A stretch of consecutive, evenly sampled rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Block {
    /// Time, s.
    pub t: Vec<f64>,
    /// One entry per joint of the robot.
    pub joints: Vec<JointColumns>,
    /// Columns without a meaning for the model, kept by name (for instance `pulses`).
    pub extra: Vec<(String, Vec<f64>)>,
    /// Line of the first row in the file (1-based; in MCAP the number of the message).
    pub first_line: u64,
    /// True if this block follows the previous one without a gap in time.
    pub continues: bool,
}

impl Block {
    /// Builds the block of a simulated motion: t, and per joint q, tau and, if given, ref.
    pub fn of_motion(motion: Motion, period: f64, reference: &[Vec<f64>]) -> Self {
        let rows = motion.q.first().map_or(0, Vec::len);
        let joints = motion.q.into_iter().zip(motion.tau).enumerate();
        Self {
            t: (0..rows).map(|k| k as f64 * period).collect(),
            joints: joints
                .map(|(j, (q, tau))| JointColumns {
                    q,
                    tau,
                    reference: reference.get(j).cloned(),
                    ..JointColumns::default()
                })
                .collect(),
            first_line: 2,
            ..Self::default()
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t.len()
    }
    /// Returns true if there are no rows.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }
}

#[cfg(test)]
mod csv_test;
#[cfg(test)]
mod mcap_test;
#[cfg(test)]
mod motors_test;
#[cfg(test)]
mod tests;
