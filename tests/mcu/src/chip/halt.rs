//! Halts of the processor by a debugger.

use super::error::ChipError;
use super::state::{Chip, TIMERS};
use crate::time::Instant;

/// DBGMCU_APB1FZR1, as a word of the debug unit, with TIM2 to TIM7 in its first bits, and its bits of the watchdogs (RM0440
/// section 47.6, "DBGMCU_APB1FZR1").
const APB1: usize = 1;
const IWDG: u32 = 1 << 12;
const WWDG: u32 = 1 << 11;
/// DBGMCU_APB2FZR likewise, with the bits of TIM1, TIM8, TIM15, TIM16, TIM17 and TIM20.
const APB2: usize = 3;
const APB2_BITS: [(u8, u32); 6] = [(1, 11), (8, 13), (15, 16), (16, 17), (17, 18), (20, 20)];

impl Chip {
    /// Halts the processor as a debugger does, from now until `end`. Timers and watchdog stand if the debug unit says so,
    /// the cycle counter always, and DFSR notes the halt.
    pub fn halt_until(&mut self, end: Instant) {
        let now = self.work.now;
        self.nvic.debug_status |= 1;
        self.held_until = end;
        self.halt = Some([now, end]);
        self.freeze(now, true);
    }

    /// Ends a halt that is over.
    pub(super) fn end_halt(&mut self, at: Instant) {
        if let Some([begin, end]) = self.halt
            && end <= at
        {
            self.halt = None;
            self.freeze(end, false);
            if self.cycle_counter.0 {
                let stood = (end - begin) / self.period;
                self.cycle_counter.1 = self.cycle_counter.1.wrapping_add(stood);
            }
        }
    }

    fn freeze(&mut self, now: Instant, frozen: bool) {
        let (apb1, apb2) = (self.debug_unit[APB1], self.debug_unit[APB2]);
        for (tim, number) in self.tim.iter_mut().zip(TIMERS) {
            let bit = APB2_BITS.iter().find(|(timer, _)| *timer == number);
            let stops = match bit {
                Some((_, bit)) => apb2 & 1 << bit != 0,
                None => apb1 & 1 << (number - 2) != 0,
            };
            if stops || !frozen {
                tim.advance(now);
                tim.freeze(now, frozen);
            }
        }
        if apb1 & IWDG != 0 {
            self.iwdg.freeze(now, frozen);
        }
        if apb1 & WWDG != 0 {
            self.wwdg.freeze(now, frozen);
        }
        if let Err(refusal) = self.update_bridge(now) {
            self.fail(ChipError::Hardware(refusal));
        }
        self.deadline = 0;
    }
}
