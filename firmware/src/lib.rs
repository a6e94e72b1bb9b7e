//! The control application of the rig, free of hardware.
#![no_std]

pub mod sample;
