//! A benchmark for developers: how often a method finds the hidden effects in recordings of the emulated rig, and how
//! often it names effects that are not there.
//!
//! All figures are over scenarios of [`rig_scenario`]; proportions have Wilson intervals. Run
//! `cargo run --release -p rig-bench -- --help` for the options.

mod answer;
mod arms;
mod cases;
mod counted;
mod error;
mod follow;
mod outcome;
mod parameters;
pub mod peer;
mod score;
mod table;
#[cfg(test)]
mod tests;
mod trial;
mod wilson;

pub use answer::{Answer, Diagnose, Evidence, Method, Named, Proposed, exact_class, is_right};
pub use arms::{ArmCase, ArmOutcome, arm_cases, arm_table, run_arms};
pub use cases::{Case, Group, Plan};
pub use error::BenchError;
pub use follow::Followed;
pub use outcome::Outcome;
pub use parameters::{Compared, compare};
pub use score::{EffectScore, GapClass, Score};
pub use table::markdown;
pub use trial::run;
pub use wilson::Proportion;
