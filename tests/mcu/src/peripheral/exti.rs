//! External interrupts (RM0440 section 16.5): the sixteen lines of the pins. The lines of other peripherals can be
//! configured, but no signal drives them.

use super::{Bank, Refusal, Register};

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "EXTI_IMR1", 0x1F84_0000, 0xFFFF_FFFF),
    Register(0x04, "EXTI_EMR1", 0, 0xFFFF_FFFF),
    Register(0x08, "EXTI_RTSR1", 0, 0x607F_FFFF),
    Register(0x0C, "EXTI_FTSR1", 0, 0x607F_FFFF),
    Register(0x10, "EXTI_SWIER1", 0, 0x0000_FFFF),
    Register(0x14, "EXTI_PR1", 0, 0),
    Register(0x20, "EXTI_IMR2", 0xFFFF_FC40, 0xFFFF_FFFF),
    Register(0x24, "EXTI_EMR2", 0, 0xFFFF_FFFF),
    Register(0x28, "EXTI_RTSR2", 0, 0x0000_03FF),
    Register(0x2C, "EXTI_FTSR2", 0, 0x0000_03FF),
    Register(0x30, "EXTI_SWIER2", 0, 0),
    Register(0x34, "EXTI_PR2", 0, 0),
];

/// The external interrupt controller.
#[derive(Clone, Debug)]
pub struct Exti(Bank);

impl Default for Exti {
    fn default() -> Self {
        Self(Bank::new(REGISTERS))
    }
}

impl Exti {
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
        match offset {
            // Writing ones clears pending bits.
            0x14 => {
                let pending = self.0.get(0x14) & !value;
                self.0.put(0x14, pending);
                Ok(())
            }
            0x34 => Ok(()),
            0x10 => {
                self.0.write(offset, value)?;
                let pending = self.0.get(0x14) | (value & self.0.get(0));
                self.0.put(0x14, pending);
                Ok(())
            }
            _ => self.0.write(offset, value).map(|_| ()),
        }
    }

    /// Handles a level change of a pin that feeds `line`.
    pub fn edge(&mut self, line: u32, rising: bool) {
        let enabled = self.0.get(if rising { 0x08 } else { 0x0C }) & 1 << line;
        if enabled != 0 {
            let pending = self.0.get(0x14) | 1 << line;
            self.0.put(0x14, pending);
        }
    }

    /// Returns the lines that request an interrupt.
    pub fn pending(&self) -> u32 {
        self.0.get(0x14) & self.0.get(0) & 0xFFFF
    }
}
