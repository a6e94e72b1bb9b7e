//! Reference trajectories of one joint.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Largest number of harmonics of a Fourier trajectory.
pub const HARMONICS: usize = 8;
/// Largest number of speeds of a friction sweep.
pub const SPEEDS: usize = 16;

/// Position, velocity and acceleration of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference<T> {
    /// rad
    pub position: T,
    /// rad/s
    pub velocity: T,
    /// rad/s²
    pub acceleration: T,
}

/// A reference motion about the point where it is started; placeholder variants are filled in by files here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Trajectory<T> {
    /// Stand still for a time, s.
    Hold(T),
}
