//! The control application of the rig, free of hardware.
//!
//! One pure function, [`step`](step::step), is the whole control tick: it takes the raw [`Sample`](sample::Sample)
//! of one trigger and gives the [`Command`](sample::Command) that acts from the next one on. A board calls
//! it from its converter interrupt; the emulated rig and the tests call it in a loop. Beside it,
//! [`speaker::Speaker`] turns bytes from the host into changes of [`State`](state::State) and what a
//! tick gave into bytes for the host.
//!
//! Nothing here knows a pin, a clock or a buffer; nothing allocates, blocks or panics.
#![no_std]
#![forbid(unsafe_code)]

mod calibration;
pub mod capture;
pub mod clerk;
pub mod config;
pub mod derived;
pub mod desk;
pub mod examined;
pub mod nameplate;
pub mod note;
pub mod reference;
pub mod request;
pub mod sample;
pub mod speaker;
pub mod state;
pub mod step;
pub mod stored;
pub mod usable;
pub mod window;

/// Version of the firmware, as the greeting tells it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
