//! Recordings: columns with units, checked line by line, read in blocks so that memory does not grow.
//!
//! [`Source`] reads CSV and MCAP alike, as many passes as asked; [`RecordingWriter`] writes both;
//! [`plausibility`] notices wrong units before they become wrong parameters. [`prepare`] filters, derives and decimates
//! them, [`runs`] holds them in memory at their full rate, and [`Compensated`] subtracts what a description knows already.
//!
//! ```
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

/// Rows at the beginning of a recording by which its columns are judged: a wrong unit or sense shows at once, and all along.
pub const JUDGED_ROWS: usize = 100_000;

/// Where the effort (torque or force) of a joint comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffortKind {
    /// Joint-side torque or force, column `tau<k>`.
    Torque,
    /// Motor current, column `i<k>`, through the drives' torque constants and ratios.
    Current,
}

/// The columns of one joint over a stretch of rows, all of the same length, SI, joint-side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointColumns {
    /// Position, rad or m (from `q<k>`, or from `qm<k>` of the motors through the drives).
    pub q: Vec<f64>,
    /// Joint torque or force, N·m or N (from `tau<k>`, or from `taum<k>` or `i<k>` of the motors through the drives); empty where
    /// the recording has neither and was opened with [`EffortNeed::Optional`].
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
    /// What an encoder on the link's side of the transmission reads, if recorded (`ql<k>`), rad or m; its zero is free.
    pub link: Option<Vec<f64>>,
    /// What of the torque is the description's effects', N·m or N; in no file, from [`crate::Compensated`].
    pub effects: Option<Vec<f64>>,
}

/// A stretch of consecutive, evenly sampled rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Block {
    /// Time, s.
    pub t: Vec<f64>,
    /// One entry per joint of the robot.
    pub joints: Vec<JointColumns>,
    /// Columns that have no meaning to the model, kept by name (for instance `pulses`).
    pub extra: Vec<(String, Vec<f64>)>,
    /// Line of the file (1-based; in MCAP the message's number) that the first row came from.
    pub first_line: u64,
    /// Whether this block follows the previous one without a gap in time.
    pub continues: bool,
}

impl Block {
    /// A simulated motion as a recording would hold it: t, and per joint q, tau and, where given, ref.
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

    /// Rows.
    pub fn len(&self) -> usize {
        self.t.len()
    }
    /// Whether there is no row.
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
