//! Results of one robot from several sets of recordings: which to trust, and why they differ.
//!
//! [`compare()`] identifies each set on its own and expresses all results in the same parameters. It pools them, tests
//! which parameters differ by more than their errors, names pairs that take over torque from each other, tests causes
//! of the difference, and tells whether it matters for the torque. [`pooled_robot`] writes the pooled values as a
//! description.
//!
//! Leaves out: effects beyond the description, which are not searched for; errors that all sets have in common, such as
//! a wrong torque constant in every recording; the uncertainty of the treatment of the recordings.

mod basis;
mod causes;
mod common;
mod compare;
mod content;
mod corrected_zero;
mod error;
mod friction_drift;
mod grade;
mod identified_set;
mod joint_test;
mod matrices;
mod motion_groups;
mod options;
mod period;
mod pool;
mod result;
mod robot;
mod rows;
mod set;
mod set_rows;
mod shrinkage;
mod significance;
mod simulated;
mod single;
#[cfg(test)]
mod tests;
mod torque;
mod trades;
mod warnings;
mod zero_shift;

pub use causes::ODDS;
pub use compare::compare;
pub use error::CompareError;
pub use options::CompareOptions;
pub use result::{
    Causes, Comparison, Corrected, Grade, Heterogeneity, Hypothesis, JointTest, Pooled,
    PooledParameter, SetSummary, SetValue, TorqueMatrix, Trade,
};
pub use robot::pooled_robot;
pub use set::RecordingSet;
pub use significance::{FAMILY_LEVEL, TEST_LEVEL};
pub use simulated::{
    Holdout, SimulateOptions, SimulatedEstimate, SimulatedRobot, SimulatedValue, SimulationError,
    TrueParameter, simulated,
};
pub use trades::{CORRELATED, TOGETHER};
