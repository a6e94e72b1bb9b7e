//! Recordings: columns with units, checked line by line, read in blocks so that memory does not grow.

/// Where the effort (torque or force) of a joint comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffortKind {
    /// Joint-side torque or force, column `tau<k>`.
    Torque,
    /// Motor current, column `i<k>`; already multiplied by the drive's gear ratio and torque constant.
    Current,
}

/// The columns of one joint over a stretch of rows, all of the same length, SI, joint-side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointColumns {
    /// Position, rad or m.
    pub q: Vec<f64>,
    /// Joint torque or force, N·m or N (from `tau<k>`, or from `i<k>` through the drive).
    pub tau: Vec<f64>,
    /// Measured velocity, if recorded.
    pub qd: Option<Vec<f64>>,
    /// Measured acceleration, if recorded.
    pub qdd: Option<Vec<f64>>,
    /// Reference position, if recorded.
    pub reference: Option<Vec<f64>>,
    /// Motor voltage, if recorded, V.
    pub voltage: Option<Vec<f64>>,
    /// Temperature, if recorded, °C.
    pub temperature: Option<Vec<f64>>,
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
    /// Line of the file (1-based) that the first row came from.
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
    let named = std::env::var_os("RIG_DATA").map(std::path::PathBuf::from);
    let beside = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    named.or(Some(beside)).filter(|p| p.is_dir())
}
