//! Reasons why a simulation under voltage ends.

/// The end of a simulation before the end of its rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Halt {
    /// Time of the recording, s.
    pub(crate) time: f64,
    /// Reason.
    pub(crate) cause: Cause,
}

/// Reasons why a free run cannot be compared with its recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The position error exceeds the joint's travel in the recordings.
    LeftTravel,
    /// Position or velocity grows without bounds.
    Unbounded,
    /// The friction with its effects would drive the joint.
    DrivingFriction,
}

impl Cause {
    /// Returns the cause as a clause.
    pub(crate) fn clause(self) -> &'static str {
        match self {
            Self::LeftTravel => {
                "the simulated position is further from the recorded one than the joint travels in the recordings"
            }
            Self::Unbounded => "the simulated motion grows without bounds",
            Self::DrivingFriction => "the friction with its effects would drive the joint",
        }
    }
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
