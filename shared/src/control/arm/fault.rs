//! Reasons why a law gives no torque.

use core::fmt;

use crate::multibody::MultibodyError;
use crate::transmission::TransmissionError;

/// Reason why a law gives no torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ControlFault {
    /// The chain refuses an argument, or its inertia matrix is not positive definite.
    Multibody(MultibodyError),
    /// The drives refuse an argument, or no motor torque gives the joint torque.
    Transmission(TransmissionError),
    /// A slice of the law's configuration has a wrong length.
    WrongLength {
        /// Name of the argument.
        argument: &'static str,
        /// Length it must have.
        expected: usize,
        /// Length it has.
        found: usize,
    },
    /// The arm cannot move its tool along a direction of the task.
    Singular {
        /// The direction, from 0.
        direction: usize,
    },
}

impl fmt::Display for ControlFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Multibody(error) => error.fmt(f),
            Self::Transmission(error) => error.fmt(f),
            Self::WrongLength {
                argument,
                expected,
                found,
            } => write!(f, "{argument} has length {found}; it must be {expected}."),
            Self::Singular { direction } => write!(
                f,
                "The arm is in a singular pose: it cannot move its tool along direction {} of the task.",
                direction + 1
            ),
        }
    }
}

impl core::error::Error for ControlFault {}

impl From<MultibodyError> for ControlFault {
    fn from(error: MultibodyError) -> Self {
        Self::Multibody(error)
    }
}

impl From<TransmissionError> for ControlFault {
    fn from(error: TransmissionError) -> Self {
        Self::Transmission(error)
    }
}

/// Checks that `argument` has the expected length.
pub(super) fn check(
    argument: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), ControlFault> {
    if expected == found {
        Ok(())
    } else {
        Err(ControlFault::WrongLength {
            argument,
            expected,
            found,
        })
    }
}
