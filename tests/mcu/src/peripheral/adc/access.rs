//! Loads and stores.

use super::converter::{
    ADCAL, ADDIS, ADEN, ADRDY, ADSTART, ADVREGEN, Adc, CALIBRATION, COMMON, CR, Codes, DEEPPWD,
    DIFSEL, DR, EOC, ISR, JADSTART, JEOC, JSQR, REGULATOR,
};
use crate::peripheral::{Refusal, told};
use crate::time::{Instant, NEVER};

impl Adc {
    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&mut self, now: Instant, offset: u32) -> Result<u32, Refusal> {
        match offset {
            COMMON => Ok(self.common),
            0x300 => Ok(self.bank.get(ISR) & 0x7FF),
            CR => {
                if self.calibrated <= now {
                    self.calibrated = NEVER;
                    let control = self.bank.get(CR) & !ADCAL;
                    self.bank.put(CR, control);
                }
                Ok(self.bank.get(CR))
            }
            DR => {
                let status = self.bank.get(ISR) & !EOC;
                self.bank.put(ISR, status);
                Ok(self.bank.get(DR))
            }
            0x80..=0x8C => {
                let status = self.bank.get(ISR) & !JEOC;
                self.bank.put(ISR, status);
                self.bank.read(offset)
            }
            _ => self.bank.read(offset),
        }
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(
        &mut self,
        now: Instant,
        offset: u32,
        value: u32,
        system: u64,
        kernel: Result<u64, Refusal>,
        codes: Codes<'_>,
    ) -> Result<(), Refusal> {
        match offset {
            COMMON => {
                // Dual mode off; clocks and internal channels.
                if value & !0x01FF_0000 != 0 {
                    return told("dual mode of the converters is not modelled");
                }
                self.common = value;
            }
            ISR => {
                let status = self.bank.get(ISR) & !value;
                self.bank.put(ISR, status);
            }
            CR => self.control(now, value, system, kernel, codes)?,
            JSQR if self.bank.get(CR) & JADSTART != 0 => {
                return told("JSQR was written while the sequence is armed");
            }
            DIFSEL if self.bank.get(CR) & ADEN != 0 => {
                return told(
                    "ADC_DIFSEL was written while the ADC was on (RM0440: only while ADEN = 0)",
                );
            }
            _ => {
                self.bank.write(offset, value)?;
            }
        }
        Ok(())
    }

    /// Writes the control register: software sets its bits and hardware clears them.
    pub(super) fn control(
        &mut self,
        now: Instant,
        value: u32,
        system: u64,
        kernel: Result<u64, Refusal>,
        codes: Codes<'_>,
    ) -> Result<(), Refusal> {
        let before = self.bank.get(CR);
        let new = value & !before;
        // Only their stop bits clear start and enable bits.
        let mut control = value | (before & (ADEN | ADSTART | JADSTART | ADCAL));
        if new & ADVREGEN != 0 {
            if value & DEEPPWD != 0 {
                return told("the ADC's regulator was switched on in deep power-down");
            }
            self.regulator = Some(now);
        }
        if value & ADVREGEN == 0 {
            self.regulator = None;
        }
        let ready = self.regulator.is_some_and(|since| now - since >= REGULATOR);
        if new & (ADCAL | ADEN) != 0 && !ready {
            return told("the ADC was used before its regulator had its 20 µs");
        }
        if new & ADCAL != 0 {
            if before & ADEN != 0 {
                return told("the ADC was calibrated while it was on");
            }
            self.calibrated = now + CALIBRATION * self.clock(system, kernel.clone())?;
        }
        if new & ADEN != 0 {
            self.flag(ADRDY);
        }
        if value & ADDIS != 0 {
            control &= !(ADEN | ADDIS);
            let status = self.bank.get(ISR) & !ADRDY;
            self.bank.put(ISR, status);
        }
        if value & 0x30 != 0 {
            // ADSTP, JADSTP.
            control &= !((value & 0x30) >> 2 | 0x30);
            self.under_way.retain(|c| match c.rank {
                Some(_) => value & 0x20 == 0,
                None => value & 0x10 == 0,
            });
        }
        self.bank.write(CR, control & (before | 0xF000_003F))?;
        self.bank.put(CR, control);
        if new & (ADSTART | JADSTART) != 0 && control & ADEN == 0 {
            return told("a conversion was started while the ADC was off");
        }
        if new & ADSTART != 0 {
            self.start_regular(now, system, kernel.clone(), codes)?;
        }
        if new & JADSTART != 0 && self.bank.get(JSQR) >> 7 & 3 == 0 {
            self.start_injected(now, system, kernel, codes)?;
        }
        Ok(())
    }
}
