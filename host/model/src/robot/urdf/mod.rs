//! Reads and writes URDF.
//!
//! Leaves out visuals, collision shapes and calibration: they do not enter the dynamics.

mod chain;
mod edits;
mod original;
mod reader;
mod remarks;
mod schema;
mod sizes;
mod spatial;
mod tree;
mod values;
mod write;

pub(super) use chain::{Body, Chain};
pub use original::Original;
pub(super) use sizes::check_sizes;
pub(super) use spatial::SpatialInertia;
pub(super) use tree::read;
pub use values::is_placeholder;
pub use write::Urdf;
