//! Loads and stores.

use super::timer::{
    AF1, AF2, ARPE, ARR, BDTR, BIF, CCER, CCMR1, CCMR2, CCR1, CEN, CNT, CR1, EGR, PSC, RCR, SMCR,
    SMS, SMS_TRIGGER, SR, TS, TS_ITR0, Tim, UDIS, UIF,
};
use crate::peripheral::{Refusal, told};
use crate::time::Instant;

/// BDTR: enable of the second break input, and the off states of the outputs.
const BK2E: u32 = 1 << 24;
const OSSI_OSSR: u32 = 3 << 10;

impl Tim {
    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&mut self, now: Instant, offset: u32) -> Result<u32, Refusal> {
        match offset {
            0x34..=0x40 => {
                let k = (offset - CCR1) / 4;
                if self.selection(k as usize).is_some_and(|s| s != 0) {
                    // Reading a captured value clears its flag (RM0440 section 30.5.5, CC1IF).
                    let status = self.bank.get(SR) & !(2 << k);
                    self.bank.put(SR, status);
                }
                self.bank.read(offset)
            }
            CNT => Ok(self.count(now)),
            CR1 => {
                let direction = u32::from(self.down && self.is_centred()) << 4;
                Ok((self.bank.get(CR1) & !0x10) | direction)
            }
            _ => self.bank.read(offset),
        }
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, now: Instant, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            SR => {
                // Writing zeros clears flags, except bits that cannot be set and breaks that still act.
                let status = self.bank.get(SR) & (value | self.acting_flags());
                self.bank.put(SR, status);
                return Ok(());
            }
            EGR => return self.generate(now, value),
            CNT => {
                let limited = if self.is_wide() {
                    value
                } else {
                    value & 0xFFFF
                };
                self.rebase(now, limited);
                return Ok(());
            }
            _ => {}
        }
        let count = self.count(now);
        let before = self.bank.write(offset, value)?;
        match offset {
            CR1 => {
                if value & 0x60 == 0 && value & 0x10 != 0 {
                    return told("a timer that counts down only is not modelled");
                }
                if (before ^ value) & CEN != 0 {
                    if !self.is_centred() {
                        self.down = false;
                    }
                    self.rebase(now, count);
                    // A match at the start value of the count counts.
                    self.checked = now.saturating_sub(1);
                }
            }
            CCMR1 | CCMR2 | CCER | SMCR if let Some(refusal) = self.unmodelled_capture() => {
                return told(refusal);
            }
            SMCR if value & SMS != 0
                && !self.is_encoder()
                && !(self.number == 4 && value & (SMS | TS) == SMS_TRIGGER | TS_ITR0) =>
            {
                return told(format!(
                    "TIM{} slave mode {:#x} is not modelled",
                    self.number,
                    value & 0x1_0007
                ));
            }
            PSC => {}
            ARR if self.bank.get(CR1) & ARPE == 0 => {
                self.active.reload = self.bank.get(ARR);
                self.rebase(now, count.min(self.active.reload));
            }
            0x34..=0x40 => {
                let k = (offset - CCR1) as usize / 4;
                if !self.is_preloaded(k) {
                    self.active.compare[k] = self.bank.get(offset);
                }
            }
            AF1 | AF2 if value & 0xE0 != 0 => {
                return told("comparators 5 to 7 at the break inputs are not modelled");
            }
            AF1 | AF2 => self.see_breaks(now),
            BDTR => {
                self.see_breaks(now);
                if self.is_broken() {
                    self.cut();
                }
                if value & BK2E != 0 && value & OSSI_OSSR != OSSI_OSSR {
                    return told(
                        "the second break input needs OSSR = OSSI = 1 (RM0440 section 28.3.17)",
                    );
                }
            }
            _ => {}
        }
        Ok(())
    }

    pub(super) fn is_preloaded(&self, channel: usize) -> bool {
        let modes = self.bank.get(if channel < 2 { CCMR1 } else { CCMR2 }) >> (8 * (channel % 2));
        modes & 8 != 0 && modes & 3 == 0
    }

    pub(super) fn generate(&mut self, now: Instant, value: u32) -> Result<(), Refusal> {
        if value & !0x9F != 0 {
            return told("EGR.TG and EGR.COMG are not modelled");
        }
        if value & 1 != 0 {
            self.down = false;
            self.repetitions = self.bank.get(RCR);
            self.load();
            self.rebase(now, 0);
            self.checked = now.saturating_sub(1);
            if self.bank.get(CR1) & (UDIS | 4) == 0 {
                self.flag(UIF);
            }
            if self.bank.get(CR1) & UDIS == 0 {
                self.send_update(now);
            }
        }
        self.flag(value & 0x1E);
        if value & 0x80 != 0 {
            self.trip(BIF);
        }
        Ok(())
    }
}
