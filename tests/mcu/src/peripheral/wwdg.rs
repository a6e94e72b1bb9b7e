//! Window watchdog (RM0440 section 44): a counter of seven bits by the APB1 clock over 4096 and a divider.
//!
//! It warns at 0x40 and resets at 0x3F, or if it is written while the counter is above the window. Left out: the phase of the
//! divider, which runs freely, so that a real one may act one count sooner.

use super::{Refusal, told};
use crate::time::{Instant, NEVER};

const ENABLE: u32 = 1 << 7;
/// The bit of the counter whose fall is the reset.
const T6: u32 = 1 << 6;
const COUNTER: u32 = 0x7F;
const EARLY_WARNING: u32 = 1 << 9;

/// The watchdog.
#[derive(Clone, Debug)]
pub struct Wwdg {
    configuration: u32,
    enabled: bool,
    /// Counter when it was last written, and that time.
    written: (u32, Instant),
    /// Length of a count then.
    count: u64,
    /// The warning was given since its flag was cleared.
    warned: bool,
    /// Time until which the warning of this count is not due, as it was given.
    warns: Instant,
    /// It was written outside its window, or with a counter below 0x40.
    misused: bool,
    /// Time of the halt of the processor since which the watchdog stands.
    frozen: Option<Instant>,
}

impl Default for Wwdg {
    fn default() -> Self {
        Self {
            configuration: COUNTER,
            enabled: false,
            written: (COUNTER, 0),
            count: 1,
            warned: false,
            warns: NEVER,
            misused: false,
            frozen: None,
        }
    }
}

impl Wwdg {
    fn counter(&self, now: Instant) -> u32 {
        let (value, at) = self.written;
        let counts = if self.enabled {
            now.saturating_sub(at) / self.count
        } else {
            0
        };
        value.saturating_sub(counts.min(COUNTER.into()) as u32)
    }

    /// Returns the time at which the counter has this value.
    fn reaches(&self, value: u32) -> Instant {
        let (from, at) = self.written;
        at + u64::from(from.saturating_sub(value)) * self.count
    }

    /// Returns the time at which it resets the chip.
    pub fn bites(&self) -> Instant {
        if self.misused {
            0
        } else if self.enabled && self.frozen.is_none() {
            self.reaches(T6 - 1)
        } else {
            NEVER
        }
    }

    /// Returns the time of its next event.
    pub fn due(&self) -> Instant {
        if self.enabled && self.frozen.is_none() {
            self.warns.min(self.bites())
        } else {
            self.bites()
        }
    }

    /// Handles the warning if it is due.
    pub fn advance(&mut self, now: Instant) {
        if self.enabled && self.frozen.is_none() && self.warns <= now {
            self.warned = true;
            self.warns = NEVER;
        }
    }

    /// Returns true if it requests its interrupt.
    pub fn requests(&self) -> bool {
        self.warned && self.configuration & EARLY_WARNING != 0
    }

    /// Stops it while the processor is halted, or lets it go on from where it stood (DBG_WWDG_STOP).
    pub fn freeze(&mut self, now: Instant, frozen: bool) {
        if frozen {
            self.frozen.get_or_insert(now);
        } else if let Some(since) = self.frozen.take() {
            self.written.1 += now - since;
            if self.warns != NEVER {
                self.warns += now - since;
            }
        }
    }

    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, now: Instant, offset: u32) -> Result<u32, Refusal> {
        match offset {
            0x00 => Ok(self.counter(now) | u32::from(self.enabled) << 7),
            0x04 => Ok(self.configuration),
            0x08 => Ok(u32::from(self.warned)),
            _ => Err(Refusal::NoRegister),
        }
    }

    /// A store; `clock` is the period of the APB1 clock.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(
        &mut self,
        now: Instant,
        clock: u64,
        offset: u32,
        value: u32,
    ) -> Result<(), Refusal> {
        match offset {
            0x00 => {
                let early = self.counter(now) > self.configuration & COUNTER;
                // Only a reset disables it.
                self.misused |= self.enabled && early || value & ENABLE != 0 && value & T6 == 0;
                self.enabled |= value & ENABLE != 0;
                self.count = (clock * 4096) << (self.configuration >> 11 & 7);
                self.written = (value & COUNTER, now);
                self.warns = self.reaches(T6);
            }
            0x04 if value & !0x3A7F != 0 => return told("WWDG_CFR has no such bits"),
            // The interrupt stays enabled until a reset.
            0x04 => self.configuration = value | self.configuration & EARLY_WARNING,
            0x08 => self.warned &= value & 1 != 0,
            _ => return Err(Refusal::NoRegister),
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod test {
    use super::*;

    #[test]
    fn warns_one_count_before_it_bites_and_not_while_it_is_fed() {
        let count = 24 * 4096;
        let mut watchdog = Wwdg::default();
        assert_eq!(watchdog.due(), NEVER, "off");
        watchdog
            .write(0, 24, 0x04, EARLY_WARNING | COUNTER)
            .unwrap();
        watchdog.write(0, 24, 0x00, ENABLE | COUNTER).unwrap();
        assert_eq!((watchdog.due(), watchdog.bites()), (63 * count, 64 * count));
        watchdog
            .write(10 * count, 24, 0x00, ENABLE | COUNTER)
            .unwrap();
        watchdog.advance(63 * count);
        assert!(!watchdog.requests(), "fed");
        watchdog.advance(73 * count);
        assert!(watchdog.requests());
        assert_eq!(watchdog.due(), 74 * count);
        watchdog.write(73 * count, 24, 0x08, 0).unwrap();
        assert!(!watchdog.requests());
    }

    #[test]
    fn a_write_above_the_window_or_of_a_low_counter_resets() {
        let mut watchdog = Wwdg::default();
        watchdog.write(0, 24, 0x04, 0x60).unwrap();
        watchdog.write(0, 24, 0x00, ENABLE | COUNTER).unwrap();
        watchdog.write(1, 24, 0x00, ENABLE | COUNTER).unwrap();
        assert_eq!(watchdog.bites(), 0);
        let mut watchdog = Wwdg::default();
        watchdog.write(0, 24, 0x00, ENABLE | 0x3F).unwrap();
        assert_eq!(watchdog.bites(), 0);
    }

    #[test]
    fn a_halt_stops_it() {
        let count = 24 * 4096;
        let mut watchdog = Wwdg::default();
        watchdog.write(0, 24, 0x00, ENABLE | COUNTER).unwrap();
        watchdog.freeze(count, true);
        assert_eq!(watchdog.due(), NEVER);
        watchdog.freeze(101 * count, false);
        assert_eq!(watchdog.bites(), 164 * count);
    }
}
