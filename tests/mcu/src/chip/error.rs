//! Errors of the emulated chip.

use thiserror::Error;

use crate::peripheral::Refusal;

/// Errors of the emulated chip.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ChipError {
    /// An access that is not modelled.
    #[error("{access} of {place} by the code at {pc:#010x}: {refusal}")]
    NotModelled {
        /// Load or store.
        access: &'static str,
        /// Peripheral and offset.
        place: String,
        /// First address of the block with the access.
        pc: u32,
        /// Reason.
        refusal: Refusal,
    },
    /// An error without an access.
    #[error("{0}")]
    Hardware(Refusal),
    /// A floating-point instruction while the unit is off.
    #[error("a floating-point instruction in the code at {0:#010x} while CPACR has the unit off")]
    FloatOff(u32),
}
