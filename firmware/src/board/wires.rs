//! Detects undriven encoder wires, also with the motor at rest. The chip's own 40 kΩ pull each wire up and down in an
//! irregular order. A driven wire does not change; an undriven wire follows.
//!
//! The channels are pulled one after the other, never both at once, which would be a wrong step. A cut wire is found
//! after [`AGREEMENTS`] checks, one every fourth tick: 12.8 ms at 10 kHz. The order repeats every 127 pulls and has at
//! most seven equal values in a row, so a line at rest agrees with at most seven. A moving line follows 32 of them only
//! if its edges are equally irregular.
//!
//! Not detected: a cut wire that touches another, or an encoder without supply that holds its outputs low. Motion shows
//! these.

use super::pins::{is_high, pull};

/// Number of consecutive checks in which a channel followed its pull.
const AGREEMENTS: u8 = 32;

/// State of the wires.
pub(crate) struct Wires {
    /// Shift register of seven bits, x⁷ + x⁶ + 1 (Golomb 1967, "Shift Register Sequences"), for both channels.
    order: u8,
    turn: usize,
    pulled: [bool; 2],
    agreed: [u8; 2],
}

impl Wires {
    /// Starts with both pulled up, as [`EncoderPins`](super::pins::EncoderPins) leaves them.
    pub(crate) const fn new() -> Self {
        Self {
            order: 1,
            turn: 0,
            pulled: [true; 2],
            agreed: [0; 2],
        }
    }

    /// Checks one channel if it is its `turn`, and pulls it for the next check. Returns true if a channel is undriven.
    #[inline(always)]
    pub(crate) fn look(&mut self, turn: bool) -> bool {
        if turn {
            self.next();
        }
        self.agreed[0].max(self.agreed[1]) >= AGREEMENTS
    }

    #[inline(always)]
    fn next(&mut self) {
        let channel = self.turn & 1;
        self.turn ^= 1;
        let agreed = if is_high(channel) == self.pulled[channel] {
            self.agreed[channel].saturating_add(1)
        } else {
            0
        };
        self.agreed[channel] = agreed;
        if channel == 0 {
            let next = (self.order >> 6 ^ self.order >> 5) & 1;
            self.order = (self.order << 1 | next) & 0x7F;
        }
        let up = self.order & 1 != 0;
        self.pulled[channel] = up;
        pull(channel, up);
    }
}
