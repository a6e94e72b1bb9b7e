//! Whether the encoder's wires are driven, told from a motor at rest too: each is pulled up and down in an irregular order by
//! the chip's own 40 kΩ. What drives it does not care; a wire that nothing drives follows.
//!
//! The channels are pulled one after the other, never both at once, which would be a wrong step. A cut wire is told after
//! [`AGREEMENTS`] looks at it, one every fourth tick: 12.8 ms at 10 kHz. The order repeats every 127 pulls and has no
//! more than seven alike in a row, so that a line at rest agrees with no more than those; that a moving one follows 32 of them
//! would need edges as irregular as they are.
//!
//! Left out: a wire that is cut and touches another, or an encoder without supply that holds its outputs low. Those show in
//! motion.

use super::pins::{is_high, pull};

/// Looks in a row in which a channel was as it was pulled.
const AGREEMENTS: u8 = 32;

/// What is remembered of the wires.
pub(crate) struct Wires {
    /// Shift register of seven bits, x⁷ + x⁶ + 1 (Golomb 1967, "Shift Register Sequences"): one order for both.
    order: u8,
    turn: usize,
    pulled: [bool; 2],
    agreed: [u8; 2],
}

impl Wires {
    /// Both pulled up, as [`EncoderPins`](super::pins::EncoderPins) leaves them.
    pub(crate) const fn new() -> Self {
        Self {
            order: 1,
            turn: 0,
            pulled: [true; 2],
            agreed: [0; 2],
        }
    }

    /// Looks at one channel in its `turn`, and pulls it anew for the next time. Whether nothing drives one.
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
