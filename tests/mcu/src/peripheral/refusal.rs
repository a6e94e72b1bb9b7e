//! Refusal of an access.

use thiserror::Error;

/// Reason why an access is refused.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Refusal {
    /// No such register in the model.
    #[error("there is no register there in the model")]
    NoRegister,
    /// Bits that are reserved or not modelled.
    #[error("bits {bits:#x} of {register} are reserved or not modelled (written {value:#010x})")]
    Bits {
        /// Name of the register.
        register: &'static str,
        /// The bits.
        bits: u32,
        /// The whole written value.
        value: u32,
    },
    /// Another reason, as text.
    #[error("{0}")]
    Told(String),
}

/// Returns a refusal as text.
pub fn told<T>(text: impl Into<String>) -> Result<T, Refusal> {
    Err(Refusal::Told(text.into()))
}
