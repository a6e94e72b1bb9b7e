//! Independent watchdog (RM0440 section 43). Its clock is the LSI, with its nominal 32 kHz.

use super::{Refusal, told};
use crate::time::{Instant, NEVER, UNITS_PER_SECOND};

const LSI_PERIOD: u64 = UNITS_PER_SECOND / 32_000;

/// The watchdog.
#[derive(Clone, Debug)]
pub struct Iwdg {
    prescaler: u32,
    reload: u32,
    unlocked: bool,
    /// Time of its reset; never until started.
    bites: Instant,
    /// Longest time between two refreshes so far.
    longest: u64,
    refreshed: Option<Instant>,
    /// Time of the halt of the processor since which the watchdog stands.
    frozen: Option<Instant>,
}

impl Default for Iwdg {
    fn default() -> Self {
        Self {
            prescaler: 0,
            reload: 0xFFF,
            unlocked: false,
            bites: NEVER,
            longest: 0,
            refreshed: None,
            frozen: None,
        }
    }
}

impl Iwdg {
    fn patience(&self) -> u64 {
        // Dividers 4 to 256 (section 43.4.2).
        let divider = 4_u64 << self.prescaler.min(6);
        (u64::from(self.reload) + 1) * divider * LSI_PERIOD
    }

    /// Returns the time at which the watchdog resets the chip if it is not fed.
    pub fn bites(&self) -> Instant {
        if self.frozen.is_some() {
            NEVER
        } else {
            self.bites
        }
    }

    /// Stops the watchdog while the processor is halted, or lets it go on from where it stood (DBG_IWDG_STOP).
    pub fn freeze(&mut self, now: Instant, frozen: bool) {
        if frozen {
            self.frozen.get_or_insert(now);
        } else if let Some(since) = self.frozen.take()
            && self.bites != NEVER
        {
            self.bites += now - since;
            self.refreshed = self.refreshed.map(|at| at + (now - since));
        }
    }

    /// Returns the longest time between two refreshes since the start.
    pub fn longest(&self) -> u64 {
        self.longest
    }

    /// A load. Register updates are immediate: the status flags read 0.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        match offset {
            0x00 | 0x0C => Ok(0),
            0x04 => Ok(self.prescaler),
            0x08 => Ok(self.reload),
            0x10 => Ok(0xFFF),
            _ => Err(Refusal::NoRegister),
        }
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, now: Instant, offset: u32, value: u32) -> Result<(), Refusal> {
        match (offset, value) {
            (0x00, 0x5555) => self.unlocked = true,
            (0x00, 0xAAAA) => {
                self.unlocked = false;
                if self.bites != NEVER {
                    if let Some(before) = self.refreshed {
                        self.longest = self.longest.max(now - before);
                    }
                    self.refreshed = Some(now);
                    self.bites = now + self.patience();
                }
            }
            (0x00, 0xCCCC) => {
                self.unlocked = false;
                self.refreshed = Some(now);
                self.bites = now + self.patience();
            }
            (0x00, other) => return told(format!("IWDG_KR takes no key {other:#x}")),
            (0x04, _) if self.unlocked => self.prescaler = value & 7,
            (0x08, _) if self.unlocked => self.reload = value & 0xFFF,
            (0x10, 0xFFF) if self.unlocked => {}
            (0x10, _) if self.unlocked => return told("the watchdog's window is not modelled"),
            (0x04 | 0x08 | 0x10, _) => {
                return told("a watchdog register was written without its key");
            }
            _ => return Err(Refusal::NoRegister),
        }
        Ok(())
    }
}
