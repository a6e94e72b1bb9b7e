//! Power control (RM0440 section 6.4): storage, and the detector of a low supply; regulators settle at once.

use super::{Bank, Refusal, Register};

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "PWR_CR1", 0x0000_0200, 0x0000_4707),
    Register(0x04, "PWR_CR2", 0, 0x0000_00FF),
    Register(0x08, "PWR_CR3", 0x0000_8000, 0x0000_E51F),
    Register(0x0C, "PWR_CR4", 0, 0x0000_031F),
    Register(0x10, "PWR_SR1", 0, 0),
    Register(0x14, "PWR_SR2", 0, 0),
    Register(0x18, "PWR_SCR", 0, 0x0000_011F),
    Register(0x80, "PWR_CR5", 0x0000_0100, 0x0000_0100),
];

/// Levels of the voltage detector by CR2.PLS, V; the eighth compares an outside pin.
const LEVELS: [f64; 7] = [2.0, 2.2, 2.4, 2.5, 2.6, 2.8, 2.9];

/// The power controller.
#[derive(Clone, Debug)]
pub struct Pwr(Bank);

impl Default for Pwr {
    fn default() -> Self {
        Self(Bank::new(REGISTERS))
    }
}

impl Pwr {
    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        self.0.read(offset)
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        self.0.write(offset, value).map(|_| ())
    }

    /// Handles APB1RSTR1.PWRRST: every register returns to its value after reset, except CR3 and CR4 (section 6.4).
    /// Stricter than the manual: section 6.4.22 says of CR5 that only a power-on reset resets it. Here it loses the boost
    /// mode as well, so that the firmware's order of start is right on either chip.
    pub fn reset(&mut self) {
        let kept = [0x08, 0x0C].map(|offset| (offset, self.0.get(offset)));
        self.0 = Bank::new(REGISTERS);
        for (offset, value) in kept {
            self.0.put(offset, value);
        }
    }

    /// Returns true if the voltage detector is on (CR2.PVDE) and `supply`, V, below its level (CR2.PLS, section 6.4.2).
    pub fn detects_low(&self, supply: f64) -> bool {
        let control = self.0.get(0x04);
        let level = LEVELS.get((control >> 1 & 7) as usize);
        control & 1 != 0 && level.is_some_and(|level| supply < *level)
    }

    /// Returns the highest system clock for the core's voltage, Hz (section 6.1.5): range 1 boost 170 MHz, range 1
    /// normal 150 MHz, range 2 26 MHz.
    pub fn fastest(&self) -> u64 {
        match (self.0.get(0) >> 9 & 3, self.0.get(0x80) & 0x100) {
            (1, 0) => 170_000_000,
            (1, _) => 150_000_000,
            _ => 26_000_000,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A reset by PWRRST takes the core voltage back; the pulls of the pins in standby (CR3.APC) stay.
    #[test]
    fn a_reset_ends_the_boost() {
        let mut pwr = Pwr::default();
        pwr.write(0x80, 0).unwrap();
        pwr.write(0x08, 1 << 10).unwrap();
        assert_eq!(pwr.fastest(), 170_000_000);
        pwr.reset();
        assert_eq!(pwr.fastest(), 150_000_000);
        assert_eq!(pwr.read(0x08), Ok(1 << 10));
    }
}
