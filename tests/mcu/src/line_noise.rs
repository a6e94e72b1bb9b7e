//! Faults of the serial line from the host, drawn byte by byte.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

use crate::chip::Chip;
use crate::peripheral::lpuart::LineError;

/// Faults to draw, and their numbers so far.
#[derive(Clone, Debug)]
pub struct LineNoise {
    random: Pcg64Mcg,
    share: f64,
    /// Bytes with a framing or noise error.
    pub flagged: u32,
    /// Bytes with a wrong bit, lost bytes and additional ones, which no flag shows.
    pub unflagged: u32,
}

impl LineNoise {
    /// Returns faults in a `share` of all bytes, each kind as often as the others.
    pub fn new(share: f64, seed: u64) -> Self {
        Self {
            random: Pcg64Mcg::seed_from_u64(seed),
            share,
            flagged: 0,
            unflagged: 0,
        }
    }

    /// Sends bytes over the line.
    pub fn send(&mut self, chip: &mut Chip, bytes: &[u8]) {
        for &byte in bytes {
            self.send_byte(chip, byte);
        }
    }

    fn send_byte(&mut self, chip: &mut Chip, byte: u8) {
        if f64::from(self.random.next_u32()) >= self.share * 2_f64.powi(32) {
            return chip.send(&[byte]);
        }
        let [kind, which] = [self.random.next_u32() % 5, self.random.next_u32()];
        let (flagged, unflagged) = if kind < 2 { (1, 0) } else { (0, 1) };
        self.flagged += flagged;
        self.unflagged += unflagged;
        match kind {
            0 => chip.send_byte(byte, Some(LineError::Framing)),
            1 => chip.send_byte(byte, Some(LineError::Noise)),
            2 => chip.send(&[byte ^ 1 << (which % 8)]),
            3 => {}
            _ => chip.send(&[byte, which as u8]),
        }
    }
}
