//! Timers (RM0440 sections 28 to 31): up-counting and centre-aligned time base with repetition counter and
//! preload, compare flags, PWM outputs, encoder mode with index, break input and system break, enable, update and encoder
//! clock as triggers, start and capture on an internal trigger.
//!
//! Left out: slave modes other than encoder and trigger mode, capture from a pin, the resynchronisation of a trigger by some clock periods,
//! dead time, DMA requests, dithering, complementary outputs. Asking for one of them is refused.

use super::{Bank, Refusal, Register, told};
use crate::time::{Instant, NEVER};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SMCR: u32 = 0x08;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCMR2: u32 = 0x1C;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const RCR: u32 = 0x30;
const CCR1: u32 = 0x34;
const BDTR: u32 = 0x44;
const ECR: u32 = 0x58;
const AF1: u32 = 0x60;

const CEN: u32 = 1;
const UDIS: u32 = 1 << 1;
const OPM: u32 = 1 << 3;
const ARPE: u32 = 1 << 7;
const UIF: u32 = 1;
const BIF: u32 = 1 << 7;
/// System break: lock-up, supply, ECC or clock (RM0440 section 28.6.5).
const SBIF: u32 = 1 << 13;
const IDXF: u32 = 1 << 20;
/// First over-capture flag.
const CC1OF: u32 = 1 << 9;
/// TIMx_CR2.MMS, whose fourth bit lies apart, at "encoder clock output" (RM0440 section 30.5.2).
const MMS: u32 = 0x0200_0070;
const MMS_ENCODER_CLOCK: u32 = 0x0200_0000;
const MMS_ENABLE: u32 = 1 << 4;
const MMS_UPDATE: u32 = 2 << 4;
/// TIMx_SMCR.SMS, whose fourth bit lies apart, at "trigger mode": a trigger starts the counter.
const SMS: u32 = 0x0001_0007;
const SMS_TRIGGER: u32 = 6;
/// TIMx_SMCR.TS, likewise in two parts.
const TS: u32 = 0x0030_0070;
/// TS of the connections that are modelled: ITR0, which is TIM1's TRGO at TIM4, and ITR1, which is TIM2's at TIM5 (RM0440
/// section 30.4.2, table of the internal trigger connections).
const TS_ITR0: u32 = 0;
const TS_ITR1: u32 = 0x10;
const BKE: u32 = 1 << 12;
const BKP: u32 = 1 << 13;
const AOE: u32 = 1 << 14;
const MOE: u32 = 1 << 15;

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
    // Break by the pin alone: BKINE, BKINP, and the ETR source.
    Register(0x60, "TIM_AF1", 0x0000_0001, 0x0003_C201),
    Register(0x64, "TIM_AF2", 0x0000_0001, 0x0000_0201),
];

/// What has taken effect, as against what is preloaded.
#[derive(Clone, Copy, Debug)]
struct Active {
    prescaler: u32,
    reload: u32,
    compare: [u32; 4],
}

/// A timer.
#[derive(Clone, Debug)]
pub struct Tim {
    number: u8,
    bank: Bank,
    /// Period of the kernel clock.
    clock: u64,
    active: Active,
    /// When the run up or down under way began.
    base: Instant,
    /// Compare matches up to here are flagged.
    checked: Instant,
    down: bool,
    repetitions: u32,
    /// Counter while it does not run by the clock.
    held: u32,
    /// Updates that went out as TRGO2 or TRGO and have not been taken.
    pulses: [Option<Instant>; 2],
    indexed: bool,
    break_active: bool,
    system_break: bool,
    /// Update events so far.
    pub updates: u64,
}

impl Tim {
    /// Timer `number` after reset, by a clock of this period.
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
            break_active: false,
            system_break: false,
            updates: 0,
        }
    }

    /// Sets the period of the kernel clock; the count goes on from where it is.
    pub fn set_clock(&mut self, now: Instant, period: u64) {
        if period != self.clock {
            let count = self.count(now);
            self.clock = period;
            self.rebase(now, count);
        }
    }

    fn is_wide(&self) -> bool {
        matches!(self.number, 2 | 5)
    }

    fn is_encoder(&self) -> bool {
        let smcr = self.bank.get(SMCR);
        matches!(smcr & 7, 1..=3) && smcr & 1 << 16 == 0
    }

    fn counts_by_clock(&self) -> bool {
        self.bank.get(CR1) & CEN != 0 && !self.is_encoder()
    }

    fn is_centred(&self) -> bool {
        self.bank.get(CR1) & 0x60 != 0
    }

    fn tick(&self) -> u64 {
        self.clock * (u64::from(self.active.prescaler) + 1)
    }

    /// Length of a run up or down, ticks.
    fn run(&self) -> u64 {
        if self.is_centred() {
            u64::from(self.active.reload).max(1)
        } else {
            u64::from(self.active.reload) + 1
        }
    }

    fn count(&self, now: Instant) -> u32 {
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

    fn rebase(&mut self, now: Instant, count: u32) {
        self.held = count;
        let into = if self.down {
            self.active.reload.saturating_sub(count)
        } else {
            count
        };
        self.base = now.saturating_sub(u64::from(into) * self.tick());
        self.checked = now;
    }

    /// Time of compare match of channel `k` in the run under way, if it has one there.
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

    /// When something happens here next that anybody waits for.
    pub fn due(&self) -> Instant {
        if !self.counts_by_clock() {
            return NEVER;
        }
        let run = self.run() * self.tick();
        // Runs to come before the update: the repetition counter has to come down first.
        let update = self.base + run * (u64::from(self.repetitions) + 1);
        let mut due = update;
        for k in 0..4 {
            if self.bank.get(DIER) & 2 << k != 0 && self.bank.get(SR) & 2 << k == 0 {
                let next = match self.match_time(k) {
                    Some(time) if time > self.checked => time,
                    // In a later run: look again when this one is over.
                    _ => self.base + run,
                };
                due = due.min(next);
            }
        }
        due
    }

    /// Lets happen what is due up to `now`.
    pub fn advance(&mut self, now: Instant) {
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

    fn flag(&mut self, bits: u32) {
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

    /// An update goes out where it is selected as TRGO2 (CR2.MMS2 = 2) or TRGO (CR2.MMS = 2) when it comes.
    fn send_update(&mut self, at: Instant) {
        let control = self.bank.get(CR2);
        if control >> 20 & 0xF == 2 {
            self.pulses[0] = Some(at);
        }
        if control & MMS == MMS_UPDATE {
            self.pulses[1] = Some(at);
        }
    }

    /// Takes the preloaded values over.
    fn load(&mut self) {
        self.active.prescaler = self.bank.get(PSC);
        self.active.reload = self.bank.get(ARR);
        for k in 0..4 {
            self.active.compare[k] = self.bank.get(CCR1 + 4 * k as u32);
        }
    }

    /// The update since the last call that went out as TRGO2.
    pub fn take_trgo2(&mut self) -> Option<Instant> {
        self.pulses[0].take()
    }

    /// The update since the last call that went out as TRGO.
    pub fn take_trgo(&mut self) -> Option<Instant> {
        self.pulses[1].take()
    }

    /// Whether the counter's enable is on and goes out as TRGO.
    pub fn sends_enable(&self) -> bool {
        self.bank.get(CR2) & MMS == MMS_ENABLE && self.bank.get(CR1) & CEN != 0
    }

    /// Internal trigger 0 rose: a counter in trigger mode starts (RM0440 section 30.4.19).
    pub fn internal_trigger_0(&mut self, at: Instant) {
        let slave = self.bank.get(SMCR) & (SMS | TS) == SMS_TRIGGER | TS_ITR0;
        if slave && self.bank.get(CR1) & CEN == 0 {
            let control = self.bank.get(CR1) | CEN;
            self.bank.put(CR1, control);
            self.rebase(at, self.held);
        }
    }

    /// When the counter of a centre-aligned timer is at 0 next, from `now`; none while it stands.
    pub fn underflow(&self, now: Instant) -> Option<Instant> {
        if !self.counts_by_clock() || !self.is_centred() {
            return None;
        }
        let run = self.run() * self.tick();
        let first = self.base + if self.down { run } else { 2 * run };
        let begun = now.saturating_sub(first).div_ceil(2 * run);
        Some(first + begun * 2 * run)
    }

    /// Counts by the encoder's edges.
    pub fn quadrature(&mut self, counts: i64) {
        if self.is_encoder() && self.bank.get(CR1) & CEN != 0 {
            let span = i64::from(self.active.reload) + 1;
            self.held = (i64::from(self.held) + counts).rem_euclid(span) as u32;
        }
    }

    /// Whether the clock of the encoder's counter goes out as TRGO.
    pub fn sends_encoder_clock(&self) -> bool {
        let on = self.is_encoder() && self.bank.get(CR1) & CEN != 0;
        on && self.bank.get(CR2) & MMS == MMS_ENCODER_CLOCK
    }

    /// How channel `k` is selected (CCxS), if it is enabled.
    fn selection(&self, k: usize) -> Option<u32> {
        let modes = self.bank.get(if k < 2 { CCMR1 } else { CCMR2 }) >> (8 * (k % 2));
        (self.bank.get(CCER) >> (4 * k) & 1 != 0).then_some(modes & 3)
    }

    /// Internal trigger 1 had an edge at `at`: channels on TRC capture the count (RM0440 section 30.4.7, "Input capture
    /// mode").
    pub fn internal_trigger_1(&mut self, at: Instant) {
        if self.bank.get(SMCR) & TS != TS_ITR1 {
            return;
        }
        for k in 0..4 {
            if self.selection(k) == Some(3) {
                let count = self.count_before(at);
                self.bank.put(CCR1 + 4 * k as u32, count);
                let captured = 2 << k;
                let missed = self.bank.get(SR) & captured != 0;
                self.flag(captured | (u32::from(missed) * (CC1OF << k)));
            }
        }
    }

    /// The count at an instant that may lie before the run under way.
    fn count_before(&self, at: Instant) -> u32 {
        if self.counts_by_clock() && at < self.base && !self.is_centred() {
            let ticks = (self.base - at).div_ceil(self.tick());
            return (u64::from(self.active.reload) + 1).saturating_sub(ticks) as u32;
        }
        self.count(at)
    }

    /// The encoder's index has passed `since` counts ago: it set the counter to 0 counting up, to its top counting
    /// down.
    pub fn index(&mut self, upwards: bool, since: u32) {
        let control = self.bank.get(ECR);
        if !self.is_encoder() || control & 1 == 0 || control & 0x20 != 0 && self.indexed {
            return;
        }
        self.indexed = true;
        self.held = if upwards {
            since
        } else {
            self.active.reload - since
        };
        self.flag(IDXF);
    }

    /// Level of the break input's pin.
    pub fn set_break_pin(&mut self, high: bool) {
        let bdtr = self.bank.get(BDTR);
        let inverted = self.bank.get(AF1) & 0x200 != 0;
        let active_high = (bdtr & BKP != 0) != inverted;
        self.break_active = bdtr & BKE != 0 && self.bank.get(AF1) & 1 != 0 && high == active_high;
        if self.break_active {
            self.trip();
        }
    }

    fn trip(&mut self) {
        self.cut();
        self.flag(BIF);
    }

    fn cut(&mut self) {
        let bdtr = self.bank.get(BDTR) & !MOE;
        self.bank.put(BDTR, bdtr);
    }

    /// Level of the system break: what goes wrong inside the chip (RM0440 section 28.3.17). It passes no filter, and flags
    /// itself apart from the break input.
    pub fn set_system_break(&mut self, active: bool) {
        self.system_break = active && self.bank.get(BDTR) & BKE != 0;
        if self.system_break {
            self.cut();
            self.flag(SBIF);
        }
    }

    /// Whether the main output can't be switched on: a break acts, or the system break's flag has not been cleared ("this
    /// flag must be reset to re-start PWM operation", section 28.6.5).
    fn is_broken(&self) -> bool {
        self.break_active || self.system_break || self.bank.get(SR) & SBIF != 0
    }

    /// Share of the time for which output `channel` (0 for CH1) is high; none while it is not driven.
    ///
    /// # Errors
    /// An output mode that is not PWM.
    pub fn output(&self, channel: usize) -> Result<Option<f64>, Refusal> {
        let enable = self.bank.get(CCER) >> (4 * channel);
        let advanced = matches!(self.number, 1 | 8 | 15 | 16 | 17 | 20);
        if enable & 1 == 0 || advanced && self.bank.get(BDTR) & MOE == 0 {
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
            // A counter that stands holds its output at the level of its count.
            f64::from(u8::from(self.held < compare))
        } else {
            (f64::from(compare) / top.max(1) as f64).min(1.0)
        };
        let active = match mode {
            6 => share,
            7 => 1.0 - share,
            // Forced inactive and active; frozen outputs stay where reset left them.
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

    /// Interrupt lines: break, update, trigger, compare.
    pub fn requests(&self) -> [bool; 4] {
        let pending = self.bank.get(SR) & self.bank.get(DIER);
        [
            // SBIF shares the break's interrupt.
            pending & BIF != 0 || self.bank.get(SR) & SBIF != 0 && self.bank.get(DIER) & BIF != 0,
            pending & UIF != 0,
            pending & 0x0010_0060 != 0,
            pending & 0x1E != 0,
        ]
    }

    /// Whether the main output is enabled.
    pub fn main_output(&self) -> bool {
        self.bank.get(BDTR) & MOE != 0
    }

    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&mut self, now: Instant, offset: u32) -> Result<u32, Refusal> {
        match offset {
            0x34..=0x40 => {
                let k = (offset - CCR1) / 4;
                if self.selection(k as usize).is_some_and(|s| s != 0) {
                    // Reading what was captured clears its flag (RM0440 section 30.5.5, CC1IF).
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
                // Cleared by zeros, save the bits that cannot be set, and breaks that still act.
                let acting =
                    (u32::from(self.break_active) * BIF) | (u32::from(self.system_break) * SBIF);
                let status = self.bank.get(SR) & (value | acting);
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
                    // A match at the very value that the count starts from counts.
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
            BDTR => {
                if self.is_broken() {
                    self.cut();
                }
                if value & 0x0100_0000 != 0 {
                    return told("the second break input is not modelled");
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// What is asked of the captures and not there.
    fn unmodelled_capture(&self) -> Option<String> {
        (0..4).find_map(|k| {
            let name = format!("TIM{} channel {}", self.number, k + 1);
            match self.selection(k)? {
                0 => None,
                3 if self.number == 5 && self.bank.get(SMCR) & TS == TS_ITR1 => {
                    let modes = self.bank.get(if k < 2 { CCMR1 } else { CCMR2 }) >> (8 * (k % 2));
                    (modes & 0xFC != 0)
                        .then(|| format!("{name} captures with filter or prescaler, which is not modelled"))
                }
                3 => Some(format!(
                    "{name} captures on an internal trigger other than TIM2's at TIM5, which is not modelled"
                )),
                _ => Some(format!("{name} captures a pin, which is not modelled")),
            }
        })
    }

    fn is_preloaded(&self, channel: usize) -> bool {
        let modes = self.bank.get(if channel < 2 { CCMR1 } else { CCMR2 }) >> (8 * (channel % 2));
        modes & 8 != 0 && modes & 3 == 0
    }

    fn generate(&mut self, now: Instant, value: u32) -> Result<(), Refusal> {
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
            self.trip();
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod test {
    use super::*;

    const CLOCK: u64 = 24;

    #[test]
    fn centre_aligned_with_repetition_updates_once_in_two_periods() {
        let mut tim = Tim::new(1, CLOCK);
        for (offset, value) in [
            (ARR, 4250),
            (RCR, 3),
            (CCMR1, 0x6868),
            (CCER, 0x11),
            (BDTR, MOE),
            (CR2, 2 << 20),
            (EGR, 1),
            (SR, 0),
            (CR1, 0x20 | ARPE),
        ] {
            tim.write(0, offset, value).unwrap();
        }
        tim.take_trgo2();
        tim.write(1000, CR1, 0x20 | ARPE | CEN).unwrap();
        // Two periods of 2 · 4250 ticks.
        let period = 4 * 4250 * CLOCK;
        assert_eq!(tim.due(), 1000 + period);
        // Preloaded: no effect before the update.
        tim.write(2000, CCR1, 2125).unwrap();
        tim.advance(1000 + period - 1);
        assert_eq!(tim.take_trgo2(), None);
        assert_eq!(tim.output(0).unwrap(), Some(0.0));
        assert_eq!(tim.read(1000 + period - 1, CNT).unwrap(), 1, "nearly down");
        tim.advance(1000 + period);
        assert_eq!(tim.take_trgo2(), Some(1000 + period));
        assert_eq!(tim.output(0).unwrap(), Some(0.5));
        assert_eq!(tim.read(1000 + period + 10 * CLOCK, CNT).unwrap(), 10);
        assert_eq!(tim.updates, 1);
    }

    #[test]
    fn compare_flags_of_a_free_running_timer() {
        let mut tim = Tim::new(3, CLOCK);
        for (offset, value) in [(PSC, 169), (EGR, 1), (SR, 0), (CCR1, 0x8000), (DIER, 2)] {
            tim.write(0, offset, value).unwrap();
        }
        tim.write(0, CR1, CEN).unwrap();
        let tick = 170 * CLOCK;
        assert_eq!(tim.due(), 0x8000 * tick);
        tim.advance(0x8000 * tick - 1);
        assert_eq!(tim.read(0, SR).unwrap() & 2, 0);
        tim.advance(0x8000 * tick);
        assert_eq!(tim.read(0, SR).unwrap() & 2, 2);
        tim.write(0, SR, !2).unwrap();
        tim.advance(0x10000 * tick);
        assert_eq!(tim.read(0x10000 * tick, CNT).unwrap(), 0);
        // CC1 waits for the next round, the others match at 0.
        assert_eq!(tim.read(0, SR).unwrap() & 3, 1);
        assert_eq!(tim.due(), 0x18000 * tick);
    }

    #[test]
    fn break_takes_the_outputs_and_holds_them() {
        let mut tim = Tim::new(1, CLOCK);
        tim.write(0, BDTR, BKE | MOE).unwrap();
        tim.set_break_pin(true);
        assert!(tim.main_output());
        tim.set_break_pin(false);
        assert!(!tim.main_output());
        tim.write(0, BDTR, BKE | MOE).unwrap();
        assert!(!tim.main_output(), "while the pin is low");
        tim.set_break_pin(true);
        assert!(!tim.main_output(), "not by itself");
        tim.write(0, BDTR, BKE | MOE).unwrap();
        assert!(tim.main_output());
        assert!(tim.read(0, SR).unwrap() & BIF != 0);
    }

    #[test]
    fn a_system_break_flags_itself_and_holds_the_outputs_until_that_is_cleared() {
        let mut tim = Tim::new(1, CLOCK);
        tim.write(0, BDTR, MOE).unwrap();
        tim.set_system_break(true);
        assert!(tim.main_output(), "the break is not enabled");
        tim.write(0, BDTR, BKE | MOE).unwrap();
        tim.set_system_break(true);
        assert!(!tim.main_output());
        assert_eq!(tim.read(0, SR).unwrap(), SBIF, "not the pin's flag");
        tim.write(0, SR, 0).unwrap();
        assert_eq!(tim.read(0, SR).unwrap(), SBIF, "it still acts");
        tim.set_system_break(false);
        tim.write(0, BDTR, BKE | MOE).unwrap();
        assert!(!tim.main_output(), "the flag is up");
        tim.write(0, SR, !SBIF).unwrap();
        tim.write(0, BDTR, BKE | MOE).unwrap();
        assert!(tim.main_output());
    }

    #[test]
    fn a_timer_in_trigger_mode_starts_with_its_master_and_sends_its_updates() {
        let mut tim = Tim::new(4, CLOCK);
        for (offset, value) in [
            (ARR, 999),
            (CNT, 100),
            (CR2, MMS_UPDATE),
            (SMCR, SMS_TRIGGER),
        ] {
            tim.write(0, offset, value).unwrap();
        }
        tim.advance(5000 * CLOCK);
        assert_eq!(tim.take_trgo(), None, "it stands");
        tim.internal_trigger_0(5000 * CLOCK);
        assert_eq!(tim.read(5010 * CLOCK, CNT).unwrap(), 110);
        tim.advance(5900 * CLOCK);
        assert_eq!(tim.take_trgo(), Some(5900 * CLOCK));
        assert_eq!(tim.take_trgo(), None);
        assert!(Tim::new(3, CLOCK).write(0, SMCR, SMS_TRIGGER).is_err());
    }

    #[test]
    fn encoder_wraps_both_ways_and_index_sets_zero() {
        let mut tim = Tim::new(2, CLOCK);
        tim.write(0, SMCR, 3).unwrap();
        tim.write(0, CR1, CEN).unwrap();
        tim.quadrature(-5);
        assert_eq!(tim.read(0, CNT).unwrap(), u32::MAX - 4);
        tim.quadrature(7);
        assert_eq!(tim.read(0, CNT).unwrap(), 2);
        tim.index(true, 0);
        assert_eq!(tim.read(0, CNT).unwrap(), 2, "index is not enabled");
        tim.write(0, ECR, 0x21).unwrap();
        tim.index(true, 0);
        assert_eq!(tim.read(0, CNT).unwrap(), 0);
        tim.quadrature(9);
        tim.index(true, 0);
        assert_eq!(tim.read(0, CNT).unwrap(), 9, "the first only");
        tim.write(0, ECR, 1).unwrap();
        tim.index(false, 3);
        assert_eq!(tim.read(0, CNT).unwrap(), u32::MAX - 3);
        assert!(tim.write(0, SMCR, 4).is_err());
    }
    #[test]
    fn encoder_clock_captures_the_count_of_another_timer() {
        let mut encoder = Tim::new(2, CLOCK);
        encoder.write(0, SMCR, 3).unwrap();
        encoder.write(0, CR1, CEN).unwrap();
        assert!(!encoder.sends_encoder_clock());
        encoder.write(0, CR2, MMS_ENCODER_CLOCK).unwrap();
        assert!(encoder.sends_encoder_clock());

        let mut tim = Tim::new(5, CLOCK);
        for (offset, value) in [(ARR, u32::MAX), (SMCR, TS_ITR1), (CCMR1, 3), (CCER, 1)] {
            tim.write(0, offset, value).unwrap();
        }
        tim.write(1000, CR1, CEN).unwrap();
        tim.internal_trigger_1(1000 + 77 * CLOCK);
        assert_eq!(tim.read(0, SR).unwrap(), 2);
        assert_eq!(tim.read(1000 + 90 * CLOCK, CCR1).unwrap(), 77);
        assert_eq!(tim.read(0, SR).unwrap(), 0, "cleared by the load");
        tim.internal_trigger_1(1000 + 100 * CLOCK);
        tim.internal_trigger_1(1000 + 101 * CLOCK);
        assert_eq!(tim.read(0, SR).unwrap(), 2 | CC1OF);
        assert_eq!(tim.read(0, CCR1).unwrap(), 101);
        // An edge shortly before the counter wrapped, told afterwards.
        let wrap = 1000 + (1_u64 << 32) * CLOCK;
        tim.advance(wrap + 5 * CLOCK);
        tim.internal_trigger_1(wrap - 3 * CLOCK);
        assert_eq!(tim.read(0, CCR1).unwrap(), u32::MAX - 2);
        tim.write(0, SMCR, 0).unwrap_err();
        assert!(Tim::new(3, CLOCK).write(0, SMCR, TS_ITR1).is_ok());
    }

    #[test]
    fn captures_that_are_not_modelled_are_refused() {
        let refused = |number, smcr, ccmr| {
            let mut tim = Tim::new(number, CLOCK);
            tim.write(0, SMCR, smcr).unwrap();
            tim.write(0, CCMR1, ccmr).unwrap();
            tim.write(0, CCER, 1).is_err()
        };
        assert!(!refused(5, TS_ITR1, 3));
        assert!(refused(5, TS_ITR1, 3 | 0x10), "filter");
        assert!(refused(5, 0, 3), "another trigger");
        assert!(refused(3, TS_ITR1, 3), "another timer");
        assert!(refused(5, TS_ITR1, 1), "a pin");
    }
}
