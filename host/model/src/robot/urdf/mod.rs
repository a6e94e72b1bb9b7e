//! Reads and writes URDF.
//!
//! Leaves out visuals, collision shapes and calibration: they do not enter the dynamics.

mod chain;
mod edits;
mod original;
mod reader;
mod remarks;
mod schema;
mod spatial;
mod tree;
mod unit_check;
mod values;
mod write;

pub(super) use chain::{Body, Chain};
pub use original::Original;
pub(super) use spatial::SpatialInertia;
pub(super) use tree::read;
pub(super) use unit_check::check_units;
pub use values::is_placeholder;
pub use write::Urdf;
