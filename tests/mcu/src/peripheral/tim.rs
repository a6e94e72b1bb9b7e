//! Timers (RM0440 sections 28 to 31): up-counting and centre-aligned time base with repetition counter and preload,
//! compare flags, PWM outputs, encoder mode with index, break inputs and system break. Enable, update and encoder clock
//! can be triggers; an internal trigger can start and capture.
//!
//! Left out: slave modes other than encoder and trigger mode, capture from a pin, the resynchronisation delay of a
//! trigger, dead time, DMA requests, dithering, complementary outputs. Using one of them is refused.

mod access;
mod break_input;
mod breaks;
mod encoder;
mod output;
#[cfg(test)]
mod test;
mod timer;

pub use timer::Tim;
