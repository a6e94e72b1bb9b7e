//! Reads and writes URDF.
//!
//! Leaves out visuals, collision shapes and calibration: they do not enter the dynamics.

mod audit;
mod chain;
mod choice;
mod edits;
mod geared;
#[cfg(test)]
mod geared_test;
mod locks;
mod names;
mod original;
mod prefixes;
mod read;
mod reader;
mod remarks;
mod schema;
mod selection;
mod spatial;
mod transmissions;
mod tree;
mod unit_check;
mod unknown_limit;
mod values;
mod write;

pub use audit::{Audit, AuditCheck, AuditFinding, audit};
pub(super) use chain::{Body, Chain, Mimic};
pub use choice::ChainChoice;
pub use original::Original;
pub(super) use read::read;
pub(super) use spatial::SpatialInertia;
pub(super) use unit_check::check_units;
pub use values::is_placeholder;
pub use write::Urdf;
pub(super) use write::escaped;
