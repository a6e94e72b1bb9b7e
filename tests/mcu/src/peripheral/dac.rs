//! DAC3 (RM0440 section 22): two channels without trigger, to on-chip peripherals, without buffer.
//!
//! Left out: triggers, waves, DMA, sample and hold, calibration, settling. Using one of them is refused.

use super::{Bank, Refusal, Register, told};

const CR: u32 = 0x00;
const DOR1: u32 = 0x2C;
const MCR: u32 = 0x3C;

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    // EN1, EN2.
    Register(0x00, "DAC_CR", 0, 0x0001_0001),
    Register(0x08, "DAC_DHR12R1", 0, 0x0000_0FFF),
    Register(0x14, "DAC_DHR12R2", 0, 0x0000_0FFF),
    Register(0x2C, "DAC_DOR1", 0, 0),
    Register(0x30, "DAC_DOR2", 0, 0),
    // MODE1, MODE2, HFSEL.
    Register(0x3C, "DAC_MCR", 0, 0x0007_C007),
];

/// A converter from code to voltage.
#[derive(Clone, Debug)]
pub struct Dac(Bank);

impl Default for Dac {
    fn default() -> Self {
        Self(Bank::new(REGISTERS))
    }
}

impl Dac {
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
        self.0.write(offset, value)?;
        let enabled = self.0.get(CR);
        for channel in 0..2 {
            if enabled & 1 << (16 * channel) != 0 {
                if self.0.get(MCR) >> (16 * channel) & 7 != 3 {
                    return told(
                        "DAC3 other than unbuffered to on-chip peripherals is not modelled",
                    );
                }
                let held = self.0.get(0x08 + 0x0C * channel);
                self.0.put(DOR1 + 4 * channel, held);
            }
        }
        Ok(())
    }

    /// Returns the output of a channel (0 or 1), as a code of its reference.
    pub fn output(&self, channel: u32) -> f64 {
        f64::from(self.0.get(DOR1 + 4 * channel))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod test {
    use super::*;

    #[test]
    fn gives_what_it_holds_once_it_is_on() {
        let mut dac = Dac::default();
        dac.write(MCR, 0x0003_8003).unwrap();
        dac.write(0x08, 2792).unwrap();
        assert_eq!(dac.output(0), 0.0);
        dac.write(CR, 0x0001_0001).unwrap();
        dac.write(0x14, 1303).unwrap();
        assert_eq!((dac.output(0), dac.output(1)), (2792.0, 1303.0));
        assert!(dac.write(CR, 0x0001_0003).is_err(), "a trigger");
        let mut other = Dac::default();
        assert!(other.write(CR, 1).is_err(), "to a pin");
    }
}
