//! The control application of the rig, free of hardware.
#![no_std]

pub mod reference;
pub mod sample;
pub mod window;
