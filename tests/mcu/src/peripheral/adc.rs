//! ADC1 (RM0440 section 21): start with its waits, calibration, the injected sequence by hardware trigger or software,
//! single regular conversions, oversampling. ADC2 has registers but no converter.
//!
//! Left out: DMA, analogue watchdogs, offsets and gain compensation, the context queue, dual mode.

mod access;
mod converter;
#[cfg(test)]
mod test;

pub use converter::{Adc, Codes};
