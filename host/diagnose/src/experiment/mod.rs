//! Next experiment that separates rival effects.
//!
//! The library has safe motions over amplitudes and speeds within the robot's limits. The chosen motion separates the
//! rivals' predictions most, the loser refitted each time (T-optimality: Atkinson and Fedorov 1975, Biometrika 62).
//! Pairs that are the same function of torque and motion need another channel, another load or another direction of
//! gravity. These are requested last.
//!
//! Leaves out: ranges of cranks and regions of the workspace; the posteriors of the rivals' parameters, which the
//! estimates represent; the other joints, which stand in mid-range.

mod choice;
mod criterion;
mod family;
mod kind;
mod lookup;
mod next;
mod nominal;
mod pairs;
mod place;
mod primitives;
mod proposal;
mod sentences;
pub mod testable;
#[cfg(test)]
mod tests;

pub use criterion::FLOOR_RATE;
pub use family::{Family, Hands};
pub use kind::ExperimentKind;
pub use next::next;
pub use nominal::{Held, Nominal};
pub(crate) use pairs::exact;
pub use proposal::Proposal;
pub use sentences::FILE;
