//! Recordings: columns with units, checked line by line, read in blocks so that memory does not grow.
//!
//! [`Source`] reads CSV and MCAP alike, as many passes as asked; [`RecordingWriter`] writes both;
//! [`plausibility`] notices wrong units before they become wrong parameters.

mod bursts;
mod columns;
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
mod place;
mod plausibility;
mod quantity;
mod rate_spike;
mod reference;
mod remark;
mod ros_layout;
mod ros_message;
mod source;
mod spike;
mod unsigned;
mod writer;

pub use columns::EffortNeed;
pub use error::{DataError, Warning};
pub use foreign::ForeignFormat;
pub(crate) use jump::jumps;
pub use place::Place;
pub use plausibility::{Implausible, plausibility, strange_rates};
pub(crate) use plausibility::{unit_of_steps, velocity_scale};
pub use quantity::Quantity;
pub(crate) use reference::reference_scale;
pub use reference::{StrangeReference, strange_references};
pub use remark::Remark;
pub use source::{Blocks, KEPT_WARNINGS, Sampling, Source};
pub use writer::{Column, CsvWriter, McapWriter, RecordingWriter};

/// Rows at the beginning of a recording by which its columns are judged: a wrong unit or sense shows at once, and all along.
pub(crate) const JUDGED_ROWS: usize = 100_000;

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
    /// What of the torque is the description's effects', N·m or N; in no file, from [`crate::effects::Compensated`].
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
    /// Rows.
    pub fn len(&self) -> usize {
        self.t.len()
    }
    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }
}

/// Folder of real recordings: the environment variable `RIG_DATA`, else `../shared/data` beside the
/// project; none where neither is there.
pub fn data_dir() -> Option<std::path::PathBuf> {
    if let Some(named) = std::env::var_os("RIG_DATA") {
        return Some(std::path::PathBuf::from(named)).filter(|p| p.is_dir());
    }
    // Cargo names the crate's folder while it runs something; a program run by hand starts where it is.
    let start = std::env::var_os("CARGO_MANIFEST_DIR").map(std::path::PathBuf::from);
    let start = start.or_else(|| std::env::current_dir().ok())?;
    // Crate, project, folder of the project, and one more for projects checked out one level deeper.
    let mut folders = start.ancestors().skip(1).take(3);
    folders.find_map(|f| Some(f.join("shared/data")).filter(|p| p.is_dir()))
}

#[cfg(test)]
mod csv_test;
#[cfg(test)]
mod mcap_test;
#[cfg(test)]
mod motors_test;
#[cfg(test)]
mod tests;
