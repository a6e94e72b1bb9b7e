//! The registers (Armv7-M ARM, B3.2 to B3.4).

use super::controller::{INTERRUPTS, Nvic, PEND_SV, SYS_TICK, WORDS};
use crate::peripheral::{Refusal, told};
use crate::time::Instant;

impl Nvic {
    /// A load; offsets from 0xE000_E000.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&mut self, now: Instant, offset: u32) -> Result<u32, Refusal> {
        let word = |bits: &[u32], base: u32| bits.get((offset - base) as usize / 4).copied();
        Ok(match offset {
            // ICTR: lines in groups of 32.
            0x004 => (INTERRUPTS as u32).div_ceil(32) - 1,
            0x008 => 0,
            0x010 => {
                let control = self.tick.control;
                self.tick.control &= !(1 << 16);
                control
            }
            0x014 => self.tick.reload,
            0x018 => {
                if self.tick.control & 1 == 0 || self.tick.period == 0 {
                    0
                } else {
                    let gone = (now - self.tick.base) / self.tick.period;
                    self.tick.reload.saturating_sub(gone as u32)
                }
            }
            // CALIB: no reference, no exact 10 ms.
            0x01C => 0xC000_0000,
            0x100..=0x11C => word(&self.enabled, 0x100).unwrap_or(0),
            0x180..=0x19C => word(&self.enabled, 0x180).unwrap_or(0),
            0x200..=0x21C | 0x280..=0x29C => {
                let index = (offset as usize & 0x7F) / 4;
                if index < WORDS {
                    self.effective(index)
                } else {
                    0
                }
            }
            0x300..=0x31C => {
                let index = (offset - 0x300) / 4;
                self.active
                    .iter()
                    .fold(0, |all, e| match e.checked_sub(16) {
                        Some(irq) if u32::from(irq / 32) == index => all | 1 << (irq % 32),
                        _ => all,
                    })
            }
            0x400..=0x4EC => self.priorities(16 + (offset as usize - 0x400)),
            0xD00 => 0x410F_C241,
            0xD04 => self.interrupt_control(),
            0xD08 => self.vectors,
            0xD0C => 0xFA05_0000 | self.grouping << 8,
            0xD10 => self.sleep,
            0xD14 => self.configuration,
            0xD18..=0xD20 => self.priorities(4 + (offset as usize - 0xD18)),
            0xD24 => self.handlers,
            0xD28 => self.fault_status[0],
            0xD2C => self.fault_status[1],
            0xD30 => self.debug_status,
            0xD34 => self.fault_status[2],
            0xD38 => self.fault_status[3],
            0xD88 => self.coprocessors,
            // MPU_TYPE: eight regions.
            0xD90 => 0x800,
            0xD94..=0xDA0 => word(&self.mpu, 0xD94).unwrap_or(0),
            // DHCSR: no debugger.
            0xDF0 => 0,
            0xDFC => self.debug,
            0xF34 => self.float_context,
            0xF3C => self.float_default,
            0xF40 => 0x1011_0021,
            0xF44 => 0x1100_0011,
            _ => return Err(Refusal::NoRegister),
        })
    }

    fn priorities(&self, from: usize) -> u32 {
        (0..4).rev().fold(0, |all, k| {
            all << 8 | u32::from(self.priority.get(from + k).copied().unwrap_or(0))
        })
    }

    fn set_priorities(&mut self, from: usize, size: u32, value: u32) {
        for k in 0..size as usize {
            if let Some(slot) = self.priority.get_mut(from + k) {
                *slot = (value >> (8 * k)) as u8 & 0xF0;
            }
        }
    }

    /// ICSR.
    fn interrupt_control(&self) -> u32 {
        let running = u32::from(self.running().unwrap_or(0));
        let pending = self.candidate.map_or(0, |(e, _)| u32::from(e));
        let system = u32::from(self.system_pending);
        let base = u32::from(self.active.len() == 1) << 11;
        running
            | base
            | pending << 12
            | u32::from(pending >= 16) << 22
            | (system >> SYS_TICK & 1) << 26
            | (system >> PEND_SV & 1) << 28
    }

    /// A store of `size` bytes; offsets from 0xE000_E000. `period` is that of the processor's clock.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(
        &mut self,
        now: Instant,
        period: u64,
        offset: u32,
        size: u32,
        value: u32,
    ) -> Result<(), Refusal> {
        match offset {
            0x400..=0x4EF => self.set_priorities(16 + (offset as usize - 0x400), size, value),
            0xD18..=0xD23 => self.set_priorities(4 + (offset as usize - 0xD18), size, value),
            _ if size != 4 => return told("only whole words of this register are modelled"),
            0x010 => self.control_tick(now, period, value)?,
            0x014 => self.tick.reload = value & 0xFF_FFFF,
            0x018 => {
                self.tick.base = now;
                self.tick.control &= !(1 << 16);
            }
            0x100..=0x11C => self.bits(offset, 0x100, |s, w| s.enabled[w] |= value)?,
            0x180..=0x19C => self.bits(offset, 0x180, |s, w| s.enabled[w] &= !value)?,
            0x200..=0x21C => self.bits(offset, 0x200, |s, w| s.pending[w] |= value)?,
            0x280..=0x29C => self.bits(offset, 0x280, |s, w| s.pending[w] &= !value)?,
            0xD04 => self.pend_by_software(value)?,
            0xD08 => self.vectors = value & 0xFFFF_FF80,
            0xD0C => {
                if value >> 16 == 0x05FA {
                    self.grouping = value >> 8 & 7;
                    self.reset_requested = value & 4 != 0;
                }
            }
            0xD10 => {
                if value & 4 != 0 {
                    return told("deep sleep (stop and standby modes) is not modelled");
                }
                self.sleep = value;
            }
            0xD14 => self.configuration = value,
            0xD24 => {
                if value & 0x7_0000 != 0 {
                    return told("handlers of single faults are not modelled: all go to HardFault");
                }
                self.handlers = value;
            }
            0xD28 => self.fault_status[0] &= !value,
            0xD2C => self.fault_status[1] &= !value,
            0xD30 => self.debug_status &= !value,
            0xD88 => self.coprocessors = value,
            0xD94 if value & 1 != 0 => return told("the MPU is not modelled"),
            0xD94..=0xDA0 => {
                if let Some(slot) = self.mpu.get_mut((offset - 0xD94) as usize / 4) {
                    *slot = value;
                }
            }
            0xDFC => self.debug = value,
            0xF00 => self.pend(16 + (value & 0x1FF) as u16),
            0xF34 => self.float_context = value,
            0xF3C => self.float_default = value,
            _ => return Err(Refusal::NoRegister),
        }
        self.choose();
        Ok(())
    }

    /// Stores SYST_CSR; `period` is that of the processor's clock.
    fn control_tick(&mut self, now: Instant, period: u64, value: u32) -> Result<(), Refusal> {
        if value & !7 != 0 && value & !0x1_0007 != 0 {
            return told("SYST_CSR has reserved bits set");
        }
        let was = self.tick.control & 1;
        self.tick.control = value & 7;
        self.tick.period = if value & 4 != 0 { period } else { 8 * period };
        if was == 0 && value & 1 != 0 {
            self.tick.base = now;
        }
        Ok(())
    }

    /// Stores ICSR: sets and clears the pending bits of PendSV and SysTick.
    fn pend_by_software(&mut self, value: u32) -> Result<(), Refusal> {
        if value & 1 << 31 != 0 {
            return told("NMI by software is not modelled");
        }
        for (set, clear, exception) in [(28, 27, PEND_SV), (26, 25, SYS_TICK)] {
            if value & 1 << set != 0 {
                self.system_pending |= 1 << exception;
            }
            if value & 1 << clear != 0 {
                self.system_pending &= !(1 << exception);
            }
        }
        Ok(())
    }

    fn bits(
        &mut self,
        offset: u32,
        base: u32,
        change: impl FnOnce(&mut Self, usize),
    ) -> Result<(), Refusal> {
        let word = (offset - base) as usize / 4;
        if word < WORDS {
            change(self, word);
        }
        Ok(())
    }
}
