//! The counter of a timer, its events and its requests.

use super::break_input::BreakInput;
use crate::peripheral::{Bank, Register};
use crate::time::{Instant, NEVER};

pub(super) const CR1: u32 = 0x00;
pub(super) const CR2: u32 = 0x04;
pub(super) const SMCR: u32 = 0x08;
pub(super) const DIER: u32 = 0x0C;
pub(super) const SR: u32 = 0x10;
pub(super) const EGR: u32 = 0x14;
pub(super) const CCMR1: u32 = 0x18;
pub(super) const CCMR2: u32 = 0x1C;
pub(super) const CCER: u32 = 0x20;
pub(super) const CNT: u32 = 0x24;
pub(super) const PSC: u32 = 0x28;
pub(super) const ARR: u32 = 0x2C;
pub(super) const RCR: u32 = 0x30;
pub(super) const CCR1: u32 = 0x34;
pub(super) const BDTR: u32 = 0x44;
pub(super) const ECR: u32 = 0x58;
pub(super) const AF1: u32 = 0x60;
pub(super) const AF2: u32 = 0x64;

pub(super) const CEN: u32 = 1;
pub(super) const UDIS: u32 = 1 << 1;
const OPM: u32 = 1 << 3;
pub(super) const ARPE: u32 = 1 << 7;
pub(super) const UIF: u32 = 1;
pub(super) const BIF: u32 = 1 << 7;
pub(super) const B2IF: u32 = 1 << 8;
/// System break: lock-up, supply, ECC or clock (RM0440 section 28.6.5).
pub(super) const SBIF: u32 = 1 << 13;
pub(super) const IDXF: u32 = 1 << 20;
pub(super) const TERRF: u32 = 1 << 23;
/// First over-capture flag.
pub(super) const CC1OF: u32 = 1 << 9;
/// TIMx_CR2.MMS at "encoder clock output" (RM0440 section 30.5.2). Its fourth bit is separate.
pub(super) const MMS: u32 = 0x0200_0070;
pub(super) const MMS_ENCODER_CLOCK: u32 = 0x0200_0000;
const MMS_ENABLE: u32 = 1 << 4;
pub(super) const MMS_UPDATE: u32 = 2 << 4;
/// TIMx_SMCR.SMS at "trigger mode": a trigger starts the counter. Its fourth bit is separate.
pub(super) const SMS: u32 = 0x0001_0007;
pub(super) const SMS_TRIGGER: u32 = 6;
/// TIMx_SMCR.TS, also in two parts.
pub(super) const TS: u32 = 0x0030_0070;
/// TS of the modelled connections: ITR0 (TIM1's TRGO at TIM4) and ITR1 (TIM2's at TIM5) (RM0440 section 30.4.2, table
/// of the internal trigger connections).
pub(super) const TS_ITR0: u32 = 0;
pub(super) const TS_ITR1: u32 = 0x10;
pub(super) const BKE: u32 = 1 << 12;
pub(super) const BKP: u32 = 1 << 13;
const AOE: u32 = 1 << 14;
pub(super) const MOE: u32 = 1 << 15;

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "TIM_CR1", 0, 0x0000_0BFF),
    Register(0x04, "TIM_CR2", 0, 0x02F5_FFFD),
    Register(0x08, "TIM_SMCR", 0, 0x0331_FFFF),
    Register(0x0C, "TIM_DIER", 0, 0x00F0_00FF),
    Register(0x10, "TIM_SR", 0, 0),
    Register(0x14, "TIM_EGR", 0, 0x0000_00FF),
    Register(0x18, "TIM_CCMR1", 0, 0x0101_FFFF),
    Register(0x1C, "TIM_CCMR2", 0, 0x0101_FFFF),
    Register(0x20, "TIM_CCER", 0, 0x0033_FFFF),
    Register(0x24, "TIM_CNT", 0, 0xFFFF_FFFF),
    Register(0x28, "TIM_PSC", 0, 0x0000_FFFF),
    Register(0x2C, "TIM_ARR", 0x0000_FFFF, 0xFFFF_FFFF),
    Register(0x30, "TIM_RCR", 0, 0x0000_FFFF),
    Register(0x34, "TIM_CCR1", 0, 0xFFFF_FFFF),
    Register(0x38, "TIM_CCR2", 0, 0xFFFF_FFFF),
    Register(0x3C, "TIM_CCR3", 0, 0xFFFF_FFFF),
    Register(0x40, "TIM_CCR4", 0, 0xFFFF_FFFF),
    Register(0x44, "TIM_BDTR", 0, 0x3FFF_FFFF),
    Register(0x48, "TIM_CCR5", 0, 0xE00F_FFFF),
    Register(0x4C, "TIM_CCR6", 0, 0x000F_FFFF),
    Register(0x50, "TIM_CCMR3", 0, 0x0101_FCFC),
    Register(0x54, "TIM_DTR2", 0, 0x0003_00FF),
    Register(0x58, "TIM_ECR", 0, 0x0000_00FF),
    Register(0x5C, "TIM_TISEL", 0, 0x0F0F_0F0F),
    // Break by pin and comparators with their polarities, and the ETR source.
    Register(0x60, "TIM_AF1", 0x0000_0001, 0x0003_FEFF),
    Register(0x64, "TIM_AF2", 0x0000_0001, 0x0000_3EFF),
];

/// Values in effect, in contrast to preloaded ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Active {
    prescaler: u32,
    pub(super) reload: u32,
    pub(super) compare: [u32; 4],
}

/// A timer.
#[derive(Clone, Debug)]
pub struct Tim {
    pub(super) number: u8,
    pub(super) bank: Bank,
    /// Period of the kernel clock.
    pub(super) clock: u64,
    pub(super) active: Active,
    /// Start of the present run up or down.
    pub(super) base: Instant,
    /// Compare matches up to this time are flagged.
    pub(super) checked: Instant,
    pub(super) down: bool,
    pub(super) repetitions: u32,
    /// Counter while the clock does not run it.
    pub(super) held: u32,
    /// Updates sent as TRGO2 or TRGO and not yet taken.
    pulses: [Option<Instant>; 2],
    pub(super) indexed: bool,
    pub(super) breaks: [BreakInput; 2],
    pub(super) system_break: bool,
    /// The debugger has halted the processor, and the timer stands meanwhile (DBG_TIMx_STOP).
    frozen: bool,
    /// Update events so far.
    pub updates: u64,
}

impl Tim {
    /// Returns timer `number` after reset, with a clock of this period.
    pub fn new(number: u8, clock: u64) -> Self {
        let mut bank = Bank::new(REGISTERS);
        let reload = if matches!(number, 2 | 5) {
            u32::MAX
        } else {
            0xFFFF
        };
        bank.put(ARR, reload);
        Self {
            number,
            bank,
            clock,
            active: Active {
                prescaler: 0,
                reload,
                compare: [0; 4],
            },
            base: 0,
            checked: 0,
            down: false,
            repetitions: 0,
            held: 0,
            pulses: [None; 2],
            indexed: false,
            // No pin of this board is the second input's: it reads low.
            breaks: [BreakInput::with_pin(true), BreakInput::with_pin(false)],
            system_break: false,
            frozen: false,
            updates: 0,
        }
    }

    /// Sets the period of the kernel clock; the count continues.
    pub fn set_clock(&mut self, now: Instant, period: u64) {
        if period != self.clock {
            let count = self.count(now);
            self.clock = period;
            self.rebase(now, count);
        }
    }

    pub(super) fn is_wide(&self) -> bool {
        matches!(self.number, 2 | 5)
    }

    pub(super) fn counts_by_clock(&self) -> bool {
        self.bank.get(CR1) & CEN != 0 && !self.is_encoder() && !self.frozen
    }

    /// Stops the counter while the processor is halted, or lets it go on from where it stood.
    pub fn freeze(&mut self, now: Instant, frozen: bool) {
        if frozen != self.frozen {
            let count = self.count(now);
            self.frozen = frozen;
            self.rebase(now, count);
        }
    }

    /// Returns true while the counter stands because the processor is halted.
    pub fn is_frozen(&self) -> bool {
        self.frozen
    }

    pub(super) fn is_centred(&self) -> bool {
        self.bank.get(CR1) & 0x60 != 0
    }

    pub(super) fn tick(&self) -> u64 {
        self.clock * (u64::from(self.active.prescaler) + 1)
    }

    /// Returns the length of a run up or down, ticks.
    pub(super) fn run(&self) -> u64 {
        if self.is_centred() {
            u64::from(self.active.reload).max(1)
        } else {
            u64::from(self.active.reload) + 1
        }
    }

    pub(super) fn count(&self, now: Instant) -> u32 {
        if !self.counts_by_clock() {
            return self.held;
        }
        let ticks = (now.saturating_sub(self.base) / self.tick()).min(self.run()) as u32;
        if self.down {
            self.active.reload.saturating_sub(ticks)
        } else {
            ticks.min(self.active.reload)
        }
    }

    pub(super) fn rebase(&mut self, now: Instant, count: u32) {
        self.held = count;
        let into = if self.down {
            self.active.reload.saturating_sub(count)
        } else {
            count
        };
        self.base = now.saturating_sub(u64::from(into) * self.tick());
        self.checked = now;
    }

    /// Returns the time of the compare match of channel `k` in the present run, if any.
    fn match_time(&self, k: usize) -> Option<Instant> {
        let compare = *self.active.compare.get(k)?;
        if compare > self.active.reload {
            return None;
        }
        if self.is_centred() {
            // CMS: 1 flags on the way down, 2 on the way up, 3 on both.
            let wanted = if self.down { 1 } else { 2 };
            if self.bank.get(CR1) >> 5 & wanted == 0 {
                return None;
            }
        }
        let ticks = if self.down {
            self.active.reload - compare
        } else {
            compare
        };
        Some(self.base + u64::from(ticks) * self.tick())
    }

    /// Returns the next event here that has a receiver.
    pub fn due(&self) -> Instant {
        self.counter_due().min(self.break_due())
    }

    fn counter_due(&self) -> Instant {
        if !self.counts_by_clock() {
            return NEVER;
        }
        let run = self.run() * self.tick();
        // Runs before the update: the repetition counter has to count down first.
        let update = self.base + run * (u64::from(self.repetitions) + 1);
        let mut due = update;
        for k in 0..4 {
            if self.bank.get(DIER) & 2 << k != 0 && self.bank.get(SR) & 2 << k == 0 {
                let next = match self.match_time(k) {
                    Some(time) if time > self.checked => time,
                    // In a later run: checked again after this one.
                    _ => self.base + run,
                };
                due = due.min(next);
            }
        }
        due
    }

    /// Handles the events due up to `now`.
    pub fn advance(&mut self, now: Instant) {
        if self.break_due() <= now {
            self.see_breaks(now);
        }
        while self.counts_by_clock() {
            let end = self.base + self.run() * self.tick();
            let until = now.min(end - 1);
            for k in 0..4 {
                if let Some(time) = self.match_time(k)
                    && time > self.checked
                    && time <= until
                {
                    self.flag(2 << k);
                }
            }
            self.checked = until;
            if end > now {
                break;
            }
            self.base = end;
            if self.is_centred() {
                self.down = !self.down;
            }
            if self.repetitions == 0 {
                self.update_event(end);
                if self.bank.get(CR1) & OPM != 0 {
                    let control = self.bank.get(CR1) & !CEN;
                    self.bank.put(CR1, control);
                    self.held = 0;
                }
            } else {
                self.repetitions -= 1;
            }
        }
    }

    pub(super) fn flag(&mut self, bits: u32) {
        let status = self.bank.get(SR) | bits;
        self.bank.put(SR, status);
    }

    fn update_event(&mut self, at: Instant) {
        self.repetitions = self.bank.get(RCR);
        if self.bank.get(CR1) & UDIS != 0 {
            return;
        }
        self.load();
        if self.bank.get(BDTR) & AOE != 0 && !self.is_broken() {
            let bdtr = self.bank.get(BDTR) | MOE;
            self.bank.put(BDTR, bdtr);
        }
        self.flag(UIF);
        self.updates += 1;
        self.send_update(at);
    }

    /// Sends an update if it is selected as TRGO2 (CR2.MMS2 = 2) or TRGO (CR2.MMS = 2) when it comes.
    pub(super) fn send_update(&mut self, at: Instant) {
        let control = self.bank.get(CR2);
        if control >> 20 & 0xF == 2 {
            self.pulses[0] = Some(at);
        }
        if control & MMS == MMS_UPDATE {
            self.pulses[1] = Some(at);
        }
    }

    /// Applies the preloaded values.
    pub(super) fn load(&mut self) {
        self.active.prescaler = self.bank.get(PSC);
        self.active.reload = self.bank.get(ARR);
        for k in 0..4 {
            self.active.compare[k] = self.bank.get(CCR1 + 4 * k as u32);
        }
    }

    /// Returns the update sent as TRGO2 since the last call.
    pub fn take_trgo2(&mut self) -> Option<Instant> {
        self.pulses[0].take()
    }

    /// Returns the update sent as TRGO since the last call.
    pub fn take_trgo(&mut self) -> Option<Instant> {
        self.pulses[1].take()
    }

    /// Returns true if the counter's enable is on and is sent as TRGO.
    pub fn sends_enable(&self) -> bool {
        self.bank.get(CR2) & MMS == MMS_ENABLE && self.bank.get(CR1) & CEN != 0
    }

    /// Handles a rise of internal trigger 0: a counter in trigger mode starts (RM0440 section 30.4.19).
    pub fn internal_trigger_0(&mut self, at: Instant) {
        let slave = self.bank.get(SMCR) & (SMS | TS) == SMS_TRIGGER | TS_ITR0;
        if slave && self.bank.get(CR1) & CEN == 0 {
            let control = self.bank.get(CR1) | CEN;
            self.bank.put(CR1, control);
            self.rebase(at, self.held);
        }
    }

    /// Returns the interrupt lines: break, update, trigger, compare.
    pub fn requests(&self) -> [bool; 4] {
        let pending = self.bank.get(SR) & self.bank.get(DIER);
        [
            // SBIF and B2IF share the break's interrupt.
            self.bank.get(SR) & (BIF | B2IF | SBIF) != 0 && self.bank.get(DIER) & BIF != 0,
            pending & UIF != 0,
            pending & 0x0010_0060 != 0,
            pending & 0x1E != 0,
        ]
    }
}
