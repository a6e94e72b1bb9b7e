//! PWM outputs.

use super::timer::{BDTR, CCER, CCMR1, CCMR2, CEN, CR1, MOE, Tim};
use crate::peripheral::{Refusal, told};
use crate::time::Instant;

impl Tim {
    /// Returns the share of the time for which output `channel` (0 for CH1) is high; `None` while it is not driven.
    ///
    /// # Errors
    /// An output mode that is not PWM.
    pub fn output(&self, channel: usize) -> Result<Option<f64>, Refusal> {
        let enable = self.bank.get(CCER) >> (4 * channel);
        let advanced = matches!(self.number, 1 | 8 | 15 | 16 | 17 | 20);
        // While the counter stands for a debugger, the outputs are disabled "as if the MOE bit was reset" (RM0440, TIM1,
        // "Debug mode").
        let disabled = self.bank.get(BDTR) & MOE == 0 || self.is_frozen();
        if enable & 1 == 0 || advanced && disabled {
            return Ok(None);
        }
        let modes = self.bank.get(if channel < 2 { CCMR1 } else { CCMR2 }) >> (8 * (channel % 2));
        let mode = (modes >> 4 & 7) | (modes >> 13 & 8);
        let top = if self.is_centred() {
            u64::from(self.active.reload)
        } else {
            u64::from(self.active.reload) + 1
        };
        let compare = self.active.compare.get(channel).copied().unwrap_or(0);
        let share = if self.bank.get(CR1) & CEN == 0 {
            // A stopped counter holds its output at the level of its count.
            f64::from(u8::from(self.held < compare))
        } else {
            (f64::from(compare) / top.max(1) as f64).min(1.0)
        };
        let active = match mode {
            6 => share,
            7 => 1.0 - share,
            // Forced inactive and active; frozen outputs keep their state after reset.
            0 | 4 => 0.0,
            5 => 1.0,
            other => {
                return told(format!(
                    "TIM{} channel {} has output mode {other}, which is not modelled",
                    self.number,
                    channel + 1
                ));
            }
        };
        Ok(Some(if enable & 2 != 0 {
            1.0 - active
        } else {
            active
        }))
    }

    /// Returns the next time from `now` at which a centre-aligned counter is at 0; `None` while it is stopped.
    pub fn underflow(&self, now: Instant) -> Option<Instant> {
        if !self.counts_by_clock() || !self.is_centred() {
            return None;
        }
        let run = self.run() * self.tick();
        let first = self.base + if self.down { run } else { 2 * run };
        let begun = now.saturating_sub(first).div_ceil(2 * run);
        Some(first + begun * 2 * run)
    }
}
