//! Errors of a run.

use thiserror::Error;

use crate::chip::ChipError;

/// Reason why a run ended early.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum EmulationError {
    /// An access that is not modelled, or a misuse of the chip.
    #[error("in {function}: {error}")]
    Chip {
        /// Running function.
        function: String,
        /// The error.
        error: ChipError,
    },
    /// The processor faulted, and no fault was expected.
    #[error("{what} at {pc:#010x} in {function}: the processor goes to HardFault")]
    Fault {
        /// The fault.
        what: String,
        /// Program counter.
        pc: u32,
        /// Function.
        function: String,
    },
    /// An unmodelled behaviour of the processor.
    #[error("{0}")]
    Processor(String),
}
