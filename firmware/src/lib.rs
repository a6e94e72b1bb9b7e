//! The control application of the rig, independent of hardware.
//!
//! One pure function, [`step`](step::step), is the control part of the tick. It takes the raw [`Sample`](sample::Sample) of
//! one trigger and returns the [`Command`](sample::Command) that acts from the next trigger on. A board calls it from
//! its converter interrupt; the emulated rig and the tests call it in a loop. [`session::Session`] turns bytes from the
//! host into requests and the output of a tick into bytes for the host. After each step,
//! [`tick_session::TickSession`] serves the requests: they change [`State`](state::State).
//!
//! No code here depends on a pin, a clock or a buffer. It never allocates, blocks or panics.
#![no_std]
#![forbid(unsafe_code)]

mod bound;
mod calibration;
pub mod capture;
pub mod config;
pub mod derived;
pub mod event;
mod motor_brake;
pub mod nameplate;
pub mod prechecked_request;
pub mod reference;
pub mod report_sender;
pub mod request;
pub mod sample;
pub mod session;
pub mod settings_storage;
pub mod state;
pub mod step;
mod stop_switch;
pub mod tick_session;
pub mod urgent_request;
pub mod validation;
pub mod window;

/// Version of the firmware, as the greeting reports it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
