//! Errors of a batch.

use rig_shared::multibody::MultibodyError;

/// Error of a batch. The outputs are then partly written and not usable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BatchError {
    /// The parameters do not fit the chain.
    #[error(transparent)]
    Multibody(#[from] MultibodyError),
    /// A signal does not have one column a joint.
    #[error("{argument} has {found} columns; the chain has {expected} joints and needs one each.")]
    WrongColumns {
        /// Name of the argument.
        argument: &'static str,
        /// Columns it must have.
        expected: usize,
        /// Columns it has.
        found: usize,
    },
    /// The columns of the signals do not all have the same number of samples.
    #[error(
        "{argument} of joint {} has {found} samples, the first column of q has {expected}; all must have the same.",
        joint + 1
    )]
    WrongSamples {
        /// Name of the argument.
        argument: &'static str,
        /// The joint, from 0 at the base.
        joint: usize,
        /// Samples it must have.
        expected: usize,
        /// Samples it has.
        found: usize,
    },
    /// An output does not have the length that the samples need.
    #[error("The output has length {found}; {columns} columns of {samples} samples need {}.", columns * samples)]
    WrongOutput {
        /// Columns it must hold.
        columns: usize,
        /// Samples of each.
        samples: usize,
        /// Length it has.
        found: usize,
    },
    /// A block of regressors was made for a chain with another number of joints.
    #[error("The block was made for {found} joints, the chain has {expected}.")]
    WrongBlock {
        /// Joints of the chain.
        expected: usize,
        /// Joints that the block was made for.
        found: usize,
    },
    /// A block of regressors has room for fewer samples than there are.
    #[error("The block has room for {room} samples, the signals have {samples}.")]
    SmallBlock {
        /// Samples that it can hold.
        room: usize,
        /// Samples of the signals.
        samples: usize,
    },
    /// The inertia matrix is not positive definite at some sample, or a number there is NaN.
    #[error(
        "The inertia matrix of sample {sample} is not positive definite at joint {}; the inertial parameters \
         describe no body that can exist, or a signal is not a number there.",
        joint + 1
    )]
    NotPositiveDefinite {
        /// The first such sample, from 0.
        sample: usize,
        /// The joint at which its factorisation failed, from 0 at the base.
        joint: usize,
    },
}
