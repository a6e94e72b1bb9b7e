//! Reasons why a transmission cannot be built or used.

use core::fmt;

use crate::multibody::{MAX_JOINTS, MultibodyError};

/// Reason why a transmission cannot be built or used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransmissionError {
    /// No motor, or more than [`MAX_JOINTS`].
    Count {
        /// Number of motors given.
        found: usize,
    },
    /// The length of a slice does not match the number of joints.
    WrongLength {
        /// Name of the argument.
        argument: &'static str,
        /// Length it must have.
        expected: usize,
        /// Length it has.
        found: usize,
    },
    /// A number of a motor's function is infinite or NaN.
    NotFinite {
        /// The motor, from 0.
        motor: usize,
        /// The parameter.
        parameter: &'static str,
    },
    /// The lead of a screw is zero.
    NoLead {
        /// The motor, from 0.
        motor: usize,
    },
    /// The screw's length is not a positive number at any angle.
    NoScrew {
        /// The motor, from 0.
        motor: usize,
    },
    /// A motor of constant ratios does not move its own joint.
    OwnRatioZero {
        /// The motor, from 0.
        motor: usize,
    },
    /// The Jacobian has no inverse here: a crank is at its dead centre, or motors turn alike.
    Singular {
        /// The motor whose row depends on those of the motors before it, from 0.
        motor: usize,
    },
    /// A screw would have to be shorter or longer than its crank allows.
    OutOfReach {
        /// The motor, from 0.
        motor: usize,
    },
    /// No joint position was found for the motor positions from the given start.
    NotFound {
        /// The motor with the largest remaining error, from 0.
        motor: usize,
    },
    /// A quantity of the chain could not be computed.
    Multibody(MultibodyError),
}

impl fmt::Display for TransmissionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count { found } => write!(
                f,
                "There are {found} drives; there must be one a joint, 1 to {MAX_JOINTS}."
            ),
            Self::WrongLength {
                argument,
                expected,
                found,
            } => write!(f, "{argument} has length {found}; it must be {expected}."),
            Self::NotFinite { motor, parameter } => write!(
                f,
                "{parameter} of drive {} is not a finite number.",
                motor + 1
            ),
            Self::NoLead { motor } => write!(
                f,
                "The lead of the screw of drive {} is 0; it must be the advance a turn, in m.",
                motor + 1
            ),
            Self::NoScrew { motor } => write!(
                f,
                "The screw of drive {} has no length at any angle of its crank; correct its geometry.",
                motor + 1
            ),
            Self::OwnRatioZero { motor } => write!(
                f,
                "Drive {0} does not move joint {0}; each motor belongs to a joint that it moves.",
                motor + 1
            ),
            Self::Singular { motor } => write!(
                f,
                "At this position drive {} moves no joint that the drives before it do not move alike: its crank is at \
                 a dead centre, or its ratios repeat another's.",
                motor + 1
            ),
            Self::OutOfReach { motor } => write!(
                f,
                "The screw of drive {} cannot have the length that this motor position asks for.",
                motor + 1
            ),
            Self::NotFound { motor } => write!(
                f,
                "No joint position was found that gives motor {} this position.",
                motor + 1
            ),
            Self::Multibody(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for TransmissionError {}

impl From<MultibodyError> for TransmissionError {
    fn from(error: MultibodyError) -> Self {
        Self::Multibody(error)
    }
}

/// Checks that `argument` has the expected length.
#[inline(always)]
pub(super) fn check(
    argument: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), TransmissionError> {
    if expected == found {
        Ok(())
    } else {
        Err(TransmissionError::WrongLength {
            argument,
            expected,
            found,
        })
    }
}
