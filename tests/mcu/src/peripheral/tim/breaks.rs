//! Sources that disable the outputs: the two break inputs with their filters, and the system break (RM0440 section 28.3.17).
//!
//! A filter passes a level that has stood for its whole length (BKF, BK2F: as many samples at a divided clock). Left out: the
//! resynchronisation of one or two cycles.

use super::timer::{AF1, AF2, B2IF, BDTR, BIF, BKE, BKP, CR1, MOE, SBIF, SR, Tim};
use crate::time::{Instant, NEVER};

/// Registers and bits of a break input.
struct Place {
    sources: u32,
    flag: u32,
    /// Shift of its enable and polarity in BDTR against those of the first input.
    shift: u32,
    /// First bit of its filter in BDTR.
    filter: u32,
}

const PLACES: [Place; 2] = [
    Place {
        sources: AF1,
        flag: BIF,
        shift: 0,
        filter: 16,
    },
    Place {
        sources: AF2,
        flag: B2IF,
        shift: 12,
        filter: 20,
    },
];

/// Divider of the filter's clock and number of samples by the value of BKF (RM0440 section 28.6.20). The first three are
/// sampled by the kernel clock, the others by t_DTS.
const FILTERS: [[u64; 2]; 16] = [
    [1, 0],
    [1, 2],
    [1, 4],
    [1, 8],
    [2, 6],
    [2, 8],
    [4, 6],
    [4, 8],
    [8, 6],
    [8, 8],
    [16, 5],
    [16, 6],
    [16, 8],
    [32, 5],
    [32, 6],
    [32, 8],
];

impl Tim {
    /// Sets the level of the pin of the first break input.
    pub fn set_break_pin(&mut self, now: Instant, high: bool) {
        self.breaks[0].levels[0] = high;
        self.see_breaks(now);
    }

    /// Sets the output of comparator `number`, 1 to 4, which both inputs can take.
    pub fn set_comparator(&mut self, now: Instant, number: usize, high: bool) {
        for input in &mut self.breaks {
            if let Some(level) = input.levels.get_mut(number) {
                *level = high;
            }
        }
        self.see_breaks(now);
    }

    /// Returns the length of the filter of an input.
    fn filter(&self, place: &Place) -> u64 {
        let code = (self.bank.get(BDTR) >> place.filter & 0xF) as usize;
        let [divider, samples] = FILTERS[code];
        let dead_time_clock = if code > 3 {
            1 << (self.bank.get(CR1) >> 8 & 3)
        } else {
            1
        };
        divider * samples * dead_time_clock * self.clock
    }

    /// Judges both inputs at `now`. Each source has its own enable and polarity, and all have the input's (RM0440, TIM1_AF1:
    /// not inverted is active low with BKP = 0 and active high with BKP = 1).
    pub(super) fn see_breaks(&mut self, now: Instant) {
        for (k, place) in PLACES.iter().enumerate() {
            let bdtr = self.bank.get(BDTR) >> place.shift;
            let sources = self.bank.get(place.sources);
            let acts = |(k, high): (usize, &bool)| {
                let inverted = sources & 0x200 << k != 0;
                sources & 1 << k != 0 && *high == ((bdtr & BKP != 0) != inverted)
            };
            let length = self.filter(place);
            let input = &mut self.breaks[k];
            if bdtr & BKE == 0 || !input.levels.iter().enumerate().any(acts) {
                (input.since, input.active) = (None, false);
                continue;
            }
            let since = *input.since.get_or_insert(now);
            input.active = now >= since + length;
            if input.active {
                self.trip(place.flag);
            }
        }
    }

    /// Returns the time at which a level passes its filter, if one is on its way.
    pub(super) fn break_due(&self) -> Instant {
        let mut due = NEVER;
        for (input, place) in self.breaks.iter().zip(&PLACES) {
            if let (Some(since), false) = (input.since, input.active) {
                due = due.min(since + self.filter(place));
            }
        }
        due
    }

    pub(super) fn trip(&mut self, flag: u32) {
        self.cut();
        self.flag(flag);
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

    /// Returns the flags of breaks that act, which cannot be cleared.
    pub(super) fn acting_flags(&self) -> u32 {
        let of = |active: bool, flag| u32::from(active) * flag;
        of(self.breaks[0].active, BIF)
            | of(self.breaks[1].active, B2IF)
            | of(self.system_break, SBIF)
    }

    /// Returns true if the main output cannot be switched on: a break acts, or the system break's flag is not cleared
    /// ("this flag must be reset to re-start PWM operation", section 28.6.5).
    pub(super) fn is_broken(&self) -> bool {
        self.acting_flags() != 0 || self.bank.get(SR) & SBIF != 0
    }

    /// Returns true if the main output is enabled.
    pub fn main_output(&self) -> bool {
        self.bank.get(BDTR) & MOE != 0
    }
}
