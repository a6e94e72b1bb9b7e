//! Sources that disable the outputs: break input and system break (RM0440 section 28.3.17).

use super::timer::{AF1, BDTR, BIF, BKE, BKP, MOE, SBIF, SR, Tim};

impl Tim {
    /// Sets the level of the break input's pin.
    pub fn set_break_pin(&mut self, high: bool) {
        self.break_levels[0] = high;
        self.see_breaks();
    }

    /// Sets the output of comparator `number`, 1 to 4.
    pub fn set_comparator(&mut self, number: usize, high: bool) {
        if let Some(level) = self.break_levels.get_mut(number) {
            *level = high;
            self.see_breaks();
        }
    }

    /// Each source has its own enable and polarity, and all have the input's (RM0440, TIM1_AF1: not inverted is active low
    /// with BKP = 0 and active high with BKP = 1).
    pub(super) fn see_breaks(&mut self) {
        let (bdtr, sources) = (self.bank.get(BDTR), self.bank.get(AF1));
        let acts = |(k, high): (usize, &bool)| {
            let inverted = sources & 0x200 << k != 0;
            sources & 1 << k != 0 && *high == ((bdtr & BKP != 0) != inverted)
        };
        self.break_active = bdtr & BKE != 0 && self.break_levels.iter().enumerate().any(acts);
        if self.break_active {
            self.trip();
        }
    }

    pub(super) fn trip(&mut self) {
        self.cut();
        self.flag(BIF);
    }

    pub(super) fn cut(&mut self) {
        let bdtr = self.bank.get(BDTR) & !MOE;
        self.bank.put(BDTR, bdtr);
    }

    /// Sets the level of the system break: faults inside the chip (RM0440 section 28.3.17). It passes no filter, and
    /// has a flag separate from the break input.
    pub fn set_system_break(&mut self, active: bool) {
        self.system_break = active && self.bank.get(BDTR) & BKE != 0;
        if self.system_break {
            self.cut();
            self.flag(SBIF);
        }
    }

    /// Returns true if the main output cannot be switched on: a break acts, or the system break's flag is not cleared
    /// ("this flag must be reset to re-start PWM operation", section 28.6.5).
    pub(super) fn is_broken(&self) -> bool {
        self.break_active || self.system_break || self.bank.get(SR) & SBIF != 0
    }

    /// Returns true if the main output is enabled.
    pub fn main_output(&self) -> bool {
        self.bank.get(BDTR) & MOE != 0
    }
}
