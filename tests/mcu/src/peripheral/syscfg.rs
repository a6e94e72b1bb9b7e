//! System configuration (RM0440 section 10.2): port of each external interrupt, remap, RAM guards.

use super::{Bank, Refusal, Register};

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "SYSCFG_MEMRMP", 0, 0),
    Register(0x04, "SYSCFG_CFGR1", 0x7C00_0001, 0xFC7F_0301),
    Register(0x08, "SYSCFG_EXTICR1", 0, 0x0000_FFFF),
    Register(0x0C, "SYSCFG_EXTICR2", 0, 0x0000_FFFF),
    Register(0x10, "SYSCFG_EXTICR3", 0, 0x0000_FFFF),
    Register(0x14, "SYSCFG_EXTICR4", 0, 0x0000_FFFF),
    Register(0x1C, "SYSCFG_CFGR2", 0, 0x0000_000F),
];

/// The system configuration controller.
#[derive(Clone, Debug)]
pub struct Syscfg(Bank);

impl Default for Syscfg {
    fn default() -> Self {
        Self(Bank::new(REGISTERS))
    }
}

impl Syscfg {
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

    /// Returns CFGR2.CLL: true if a lock-up of the processor acts on the timers' break inputs.
    pub fn breaks_on_lockup(&self) -> bool {
        self.0.get(0x1C) & 1 != 0
    }

    /// Returns CFGR2.ECCL: true if an uncorrectable flash word acts on the timers' break inputs.
    pub fn breaks_on_flash_error(&self) -> bool {
        self.0.get(0x1C) & 8 != 0
    }

    /// Returns CFGR2.PVDL: true if the voltage detector acts on the timers' break inputs.
    pub fn breaks_on_low_supply(&self) -> bool {
        self.0.get(0x1C) & 4 != 0
    }

    /// Returns the port (0 for A) that feeds external interrupt `line`.
    pub fn port_of(&self, line: u32) -> u8 {
        let register = 0x08 + 4 * (line / 4);
        (self.0.get(register) >> (4 * (line % 4)) & 0xF) as u8
    }
}
