//! Settings of a diagnosis.

use rig_data::runs::Run;
use rig_shared::effects::Kind;

use crate::outcome::DataFault;

/// Settings of a diagnosis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Effects that are left out of the library.
    pub without: Vec<Kind>,
    /// True to fit recordings even if their data have certain faults.
    pub even_if_wrong: bool,
    /// Number of threads; 0 for all that the machine has.
    pub threads: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Zero of each joint's sensor and its standard deviation, from [`crate::sensor_zeros`]; empty if not recorded.
    pub sensor_zeros: Vec<[f64; 2]>,
    /// Recordings of clamped joints, from [`fn@crate::clamped`]; only their voltage is fitted.
    pub clamped: Vec<Run>,
    /// True if the description's format has no field for a constant torque. The constant is then fitted with the
    /// friction, as in an identification.
    pub no_offsets: bool,
}

impl Options {
    /// Returns true if recordings with these faults are fitted.
    pub(crate) fn fits(&self, faults: &[DataFault]) -> bool {
        (faults.iter()).all(|fault| !fault.certain || self.even_if_wrong && fault.leaves_rows())
    }
}
