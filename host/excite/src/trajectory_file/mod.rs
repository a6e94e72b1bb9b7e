//! Trajectories in files: their parameters as TOML, their samples as CSV.

mod content;
mod foreign;
mod read;
mod reference;
mod samples;
mod storage;
mod text;
mod write;

pub use content::{COASTING, DesignRecord, JointTrajectory, TrajectoryFile};
pub use reference::{load_reference, reference_at};
pub use samples::SampledReference;
