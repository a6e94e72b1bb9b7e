//! Detects undriven encoder wires, also with the motor at rest. The chip's own 40 kΩ pull each wire up and down in an
//! irregular order. A driven wire does not change; an undriven wire follows.
//!
//! The channels are pulled one after the other, never both at once, which would be a wrong step. A cut wire is found
//! after [`MIN_AGREEMENTS`] checks, one every fourth tick: 12.8 ms at 10 kHz. The order repeats every 127 pulls and has
//! at most seven equal values in a row, so a line at rest agrees with at most seven. A moving line follows 32 of them
//! only if its edges are equally irregular.
//!
//! Not detected: a cut wire that touches another, or an encoder without supply that holds its outputs low. Motion shows
//! these.

use super::pins::{is_high, pull};

/// Number of consecutive checks in which a channel followed its pull.
const MIN_AGREEMENTS: u8 = 32;

/// State of the wires.
pub(crate) struct WireCheck {
    /// Shift register of seven bits, x⁷ + x⁶ + 1 (Golomb 1967, "Shift Register Sequences"), for both channels.
    sequence: u8,
    turn: usize,
    pull_up: [bool; 2],
    agreements: [u8; 2],
    /// True if a channel is undriven.
    open: bool,
}

impl WireCheck {
    /// Starts with both pulled up, as [`EncoderPins`](super::pins::EncoderPins) leaves them.
    pub(crate) const fn new() -> Self {
        Self {
            sequence: 1,
            turn: 0,
            pull_up: [true; 2],
            agreements: [0; 2],
            open: false,
        }
    }

    /// Checks one channel if it is its `turn`, and pulls it for the next check. Returns true if a channel is undriven.
    #[inline(always)]
    pub(crate) fn check(&mut self, turn: bool) -> bool {
        if turn {
            self.check_channel();
        }
        self.open
    }

    #[inline(always)]
    fn check_channel(&mut self) {
        let channel = self.turn & 1;
        self.turn ^= 1;
        let agreements = if is_high(channel) == self.pull_up[channel] {
            self.agreements[channel].saturating_add(1)
        } else {
            0
        };
        self.agreements[channel] = agreements;
        self.open = self.agreements[0].max(self.agreements[1]) >= MIN_AGREEMENTS;
        if channel == 0 {
            let feedback = (self.sequence >> 6 ^ self.sequence >> 5) & 1;
            self.sequence = (self.sequence << 1 | feedback) & 0x7F;
        }
        let up = self.sequence & 1 != 0;
        self.pull_up[channel] = up;
        pull(channel, up);
    }
}
