//! Reasons why a simulation under voltage ends.

use serde::Serialize;

/// The end of a simulation before the end of its rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Halt {
    /// Time of the recording, s.
    pub(crate) time: f64,
    /// Reason.
    pub(crate) cause: Cause,
}

/// Reasons why a free run cannot be compared with its recording; serialises to a clause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(into = "&'static str")]
pub enum Cause {
    /// The position error exceeds the joint's travel in the recordings.
    LeftTravel,
    /// Position or velocity grows without bounds.
    Unbounded,
    /// The friction with its effects would drive the joint.
    DrivingFriction,
}

impl Halt {
    /// Friction that would drive the joint at `time`, s.
    pub(crate) fn driving(time: f64) -> Self {
        Self {
            time,
            cause: Cause::DrivingFriction,
        }
    }

    /// An unbounded motion at `time`, s.
    pub(crate) fn unbounded(time: f64) -> Self {
        Self {
            time,
            cause: Cause::Unbounded,
        }
    }
}
