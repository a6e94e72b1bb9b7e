//! Exceptions and the system control space (ARMv7-M ARM DDI 0403E, B1.5 and B3): priorities, preemption,
//! pending and enable bits, SysTick, system control block.
//!
//! Left out: the MPU's effect (its registers are storage, and switching it on is refused), fault handlers
//! other than HardFault (everything escalates unless they are enabled, which is refused), debug.

use crate::cpu::Masks;
use crate::peripheral::{Refusal, told};
use crate::time::{Instant, NEVER};

/// Interrupts of the chip.
pub const INTERRUPTS: usize = 102;
/// Exception numbers.
pub const HARD_FAULT: u16 = 3;
/// SVC.
pub const SV_CALL: u16 = 11;
/// PendSV.
pub const PEND_SV: u16 = 14;
/// SysTick.
pub const SYS_TICK: u16 = 15;

const WORDS: usize = INTERRUPTS.div_ceil(32);
/// Priority of thread mode with nothing masked.
const THREAD: i16 = 256;

#[derive(Clone, Debug, Default)]
struct SysTick {
    control: u32,
    reload: u32,
    /// When the count under way began, at `reload`.
    base: Instant,
    period: u64,
}

/// The interrupt controller with the system control block.
#[derive(Clone, Debug)]
pub struct Nvic {
    enabled: [u32; WORDS],
    pending: [u32; WORDS],
    level: [u32; WORDS],
    priority: [u8; 16 + INTERRUPTS],
    /// Pending system exceptions by number.
    system_pending: u16,
    /// Active exceptions, the running one last.
    active: Vec<u16>,
    tick: SysTick,
    vectors: u32,
    sleep: u32,
    configuration: u32,
    handlers: u32,
    grouping: u32,
    coprocessors: u32,
    float_context: u32,
    float_default: u32,
    fault_status: [u32; 4],
    debug: u32,
    mpu: [u32; 4],
    /// Reset has been requested by AIRCR.
    pub reset_requested: bool,
    /// The most urgent exception that is pending, and its priority.
    candidate: Option<(u16, i16)>,
}

impl Default for Nvic {
    fn default() -> Self {
        Self {
            enabled: [0; WORDS],
            pending: [0; WORDS],
            level: [0; WORDS],
            priority: [0; 16 + INTERRUPTS],
            system_pending: 0,
            active: Vec::new(),
            tick: SysTick::default(),
            vectors: 0,
            sleep: 0,
            configuration: 0x200,
            handlers: 0,
            grouping: 0,
            coprocessors: 0,
            // ASPEN and LSPEN.
            float_context: 0xC000_0000,
            float_default: 0,
            fault_status: [0; 4],
            debug: 0,
            mpu: [0; 4],
            reset_requested: false,
            candidate: None,
        }
    }
}

impl Nvic {
    /// Address of the vector table.
    pub fn vectors(&self) -> u32 {
        self.vectors
    }

    /// Whether the floating-point unit may be used (CPACR, full access to CP10 and CP11).
    pub fn float_enabled(&self) -> bool {
        self.coprocessors >> 20 & 0xF == 0xF
    }

    /// FPDSCR: what FPSCR begins with in a new context.
    pub fn float_default(&self) -> u32 {
        self.float_default
    }

    /// Whether SCR.SEVONPEND is set.
    pub fn pending_wakes(&self) -> bool {
        self.sleep & 0x10 != 0
    }

    /// Whether SCR.SLEEPONEXIT is set.
    pub fn sleeps_on_exit(&self) -> bool {
        self.sleep & 2 != 0
    }

    /// The running exception; none in thread mode.
    pub fn running(&self) -> Option<u16> {
        self.active.last().copied()
    }

    /// How many exceptions are nested.
    pub fn depth(&self) -> usize {
        self.active.len()
    }

    /// Group priority of an exception.
    fn priority_of(&self, exception: u16) -> i16 {
        match exception {
            2 => -2,
            HARD_FAULT => -1,
            _ => {
                let raw = self.priority.get(exception as usize).copied().unwrap_or(0);
                self.group(raw)
            }
        }
    }

    /// The part of a priority that decides about preemption (AIRCR.PRIGROUP). Four bits are implemented.
    fn group(&self, raw: u8) -> i16 {
        let split = self.grouping + 1;
        i16::from(raw & 0xF0) & !((1 << split) - 1)
    }

    /// Priority at which the processor runs.
    fn running_priority(&self, masks: Masks) -> i16 {
        let mut now = THREAD;
        for exception in &self.active {
            now = now.min(self.priority_of(*exception));
        }
        if masks.basepri != 0 {
            now = now.min(self.group(masks.basepri));
        }
        if masks.primask {
            now = now.min(0);
        }
        if masks.faultmask {
            now = now.min(-1);
        }
        now
    }

    /// Finds the most urgent pending exception anew.
    fn choose(&mut self) {
        let mut best: Option<(u16, i16, u8)> = None;
        let mut consider = |exception: u16, group: i16, raw: u8| {
            // Equal priorities: the lower number first; sub-priority before that.
            if best.is_none_or(|(_, g, r)| (group, raw) < (g, r)) {
                best = Some((exception, group, raw));
            }
        };
        for exception in 2..16 {
            if self.system_pending & 1 << exception != 0 {
                let raw = self.priority.get(exception as usize).copied().unwrap_or(0);
                consider(exception, self.priority_of(exception), raw);
            }
        }
        for word in 0..WORDS {
            let mut bits = self.effective(word) & self.enabled[word];
            while bits != 0 {
                let exception = 16 + (word * 32) as u16 + bits.trailing_zeros() as u16;
                let raw = self.priority.get(exception as usize).copied().unwrap_or(0);
                consider(exception, self.priority_of(exception), raw);
                bits &= bits - 1;
            }
        }
        self.candidate = best.map(|(exception, group, _)| (exception, group));
    }

    /// Pending bits: latched, or by a line that is up while its handler does not run.
    fn effective(&self, word: usize) -> u32 {
        let mut running = 0;
        for exception in &self.active {
            if let Some(irq) = exception.checked_sub(16)
                && usize::from(irq / 32) == word
            {
                running |= 1 << (irq % 32);
            }
        }
        self.pending[word] | (self.level[word] & !running)
    }

    /// Levels of the interrupt lines.
    pub fn set_lines(&mut self, lines: [u32; WORDS]) {
        if lines == self.level {
            return;
        }
        for word in 0..WORDS {
            self.pending[word] |= lines[word] & !self.level[word];
        }
        self.level = lines;
        self.choose();
    }

    /// Makes an exception pending.
    pub fn pend(&mut self, exception: u16) {
        match exception.checked_sub(16) {
            None => self.system_pending |= 1 << exception,
            Some(irq) => {
                if let Some(word) = self.pending.get_mut(usize::from(irq / 32)) {
                    *word |= 1 << (irq % 32);
                }
            }
        }
        self.choose();
    }

    /// Whether an exception is pending that could preempt what runs, were nothing masked.
    pub fn is_interested(&self) -> bool {
        self.candidate
            .is_some_and(|(_, priority)| self.running_priority(Masks::default()) > priority)
    }

    /// The exception to take now, if any.
    pub fn next(&self, masks: Masks) -> Option<u16> {
        let (exception, priority) = self.candidate?;
        (priority < self.running_priority(masks)).then_some(exception)
    }

    /// Whether WFI ends: PRIMASK does not count (B1.5.19).
    pub fn wakes(&self, masks: Masks) -> bool {
        self.next(Masks {
            primask: false,
            ..masks
        })
        .is_some()
    }

    /// Whether anything enabled is pending, whatever its priority.
    pub fn has_pending(&self) -> bool {
        self.candidate.is_some()
    }

    /// Enters an exception.
    pub fn enter(&mut self, exception: u16) {
        match exception.checked_sub(16) {
            None => self.system_pending &= !(1 << exception),
            Some(irq) => {
                if let Some(word) = self.pending.get_mut(usize::from(irq / 32)) {
                    *word &= !(1 << (irq % 32));
                }
            }
        }
        self.active.push(exception);
        self.choose();
    }

    /// Leaves the running exception.
    pub fn leave(&mut self) -> Option<u16> {
        let left = self.active.pop();
        self.choose();
        left
    }

    /// When SysTick counts to zero next.
    pub fn due(&self) -> Instant {
        if self.tick.control & 3 == 3 && self.tick.reload != 0 {
            self.tick.base + (u64::from(self.tick.reload) + 1) * self.tick.period
        } else {
            NEVER
        }
    }

    /// Lets SysTick happen.
    pub fn advance(&mut self, now: Instant) {
        while self.due() <= now {
            self.tick.base = self.due();
            self.tick.control |= 1 << 16;
            self.pend(SYS_TICK);
        }
    }

    /// A fault with its status, address and cause for CFSR.
    pub fn fault(&mut self, status: u32, address: u32) {
        self.fault_status[0] |= status;
        // FORCED.
        self.fault_status[1] |= 1 << 30;
        self.fault_status[3] = address;
    }

    /// A load; offsets from 0xE000_E000.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&mut self, now: Instant, offset: u32) -> Result<u32, Refusal> {
        let word = |bits: &[u32], base: u32| bits.get((offset - base) as usize / 4).copied();
        Ok(match offset {
            // ICTR: lines in groups of 32.
            0x004 => (INTERRUPTS as u32).div_ceil(32) - 1,
            0x008 => 0,
            0x010 => {
                let control = self.tick.control;
                self.tick.control &= !(1 << 16);
                control
            }
            0x014 => self.tick.reload,
            0x018 => {
                if self.tick.control & 1 == 0 || self.tick.period == 0 {
                    0
                } else {
                    let gone = (now - self.tick.base) / self.tick.period;
                    self.tick.reload.saturating_sub(gone as u32)
                }
            }
            // CALIB: no reference, no exact 10 ms.
            0x01C => 0xC000_0000,
            0x100..=0x11C => word(&self.enabled, 0x100).unwrap_or(0),
            0x180..=0x19C => word(&self.enabled, 0x180).unwrap_or(0),
            0x200..=0x21C | 0x280..=0x29C => {
                let index = (offset as usize & 0x7F) / 4;
                if index < WORDS {
                    self.effective(index)
                } else {
                    0
                }
            }
            0x300..=0x31C => {
                let index = (offset - 0x300) / 4;
                self.active
                    .iter()
                    .fold(0, |all, e| match e.checked_sub(16) {
                        Some(irq) if u32::from(irq / 32) == index => all | 1 << (irq % 32),
                        _ => all,
                    })
            }
            0x400..=0x4EC => self.priorities(16 + (offset as usize - 0x400)),
            0xD00 => 0x410F_C241,
            0xD04 => self.interrupt_control(),
            0xD08 => self.vectors,
            0xD0C => 0xFA05_0000 | self.grouping << 8,
            0xD10 => self.sleep,
            0xD14 => self.configuration,
            0xD18..=0xD20 => self.priorities(4 + (offset as usize - 0xD18)),
            0xD24 => self.handlers,
            0xD28 => self.fault_status[0],
            0xD2C => self.fault_status[1],
            0xD34 => self.fault_status[2],
            0xD38 => self.fault_status[3],
            0xD88 => self.coprocessors,
            // MPU_TYPE: eight regions.
            0xD90 => 0x800,
            0xD94..=0xDA0 => word(&self.mpu, 0xD94).unwrap_or(0),
            // DHCSR: no debugger.
            0xDF0 => 0,
            0xDFC => self.debug,
            0xF34 => self.float_context,
            0xF3C => self.float_default,
            0xF40 => 0x1011_0021,
            0xF44 => 0x1100_0011,
            _ => return Err(Refusal::NoRegister),
        })
    }

    fn priorities(&self, from: usize) -> u32 {
        (0..4).rev().fold(0, |all, k| {
            all << 8 | u32::from(self.priority.get(from + k).copied().unwrap_or(0))
        })
    }

    fn set_priorities(&mut self, from: usize, size: u32, value: u32) {
        for k in 0..size as usize {
            if let Some(slot) = self.priority.get_mut(from + k) {
                *slot = (value >> (8 * k)) as u8 & 0xF0;
            }
        }
    }

    /// ICSR.
    fn interrupt_control(&self) -> u32 {
        let running = u32::from(self.running().unwrap_or(0));
        let pending = self.candidate.map_or(0, |(e, _)| u32::from(e));
        let system = u32::from(self.system_pending);
        let base = u32::from(self.active.len() == 1) << 11;
        running
            | base
            | pending << 12
            | u32::from(pending >= 16) << 22
            | (system >> SYS_TICK & 1) << 26
            | (system >> PEND_SV & 1) << 28
    }

    /// A store of `size` bytes; offsets from 0xE000_E000. `period` is that of the processor's clock.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(
        &mut self,
        now: Instant,
        period: u64,
        offset: u32,
        size: u32,
        value: u32,
    ) -> Result<(), Refusal> {
        match offset {
            0x400..=0x4EF => self.set_priorities(16 + (offset as usize - 0x400), size, value),
            0xD18..=0xD23 => self.set_priorities(4 + (offset as usize - 0xD18), size, value),
            _ if size != 4 => return told("only whole words of this register are modelled"),
            0x010 => {
                if value & !7 != 0 && value & !0x1_0007 != 0 {
                    return told("SYST_CSR has reserved bits set");
                }
                let was = self.tick.control & 1;
                self.tick.control = value & 7;
                self.tick.period = if value & 4 != 0 { period } else { 8 * period };
                if was == 0 && value & 1 != 0 {
                    self.tick.base = now;
                }
            }
            0x014 => self.tick.reload = value & 0xFF_FFFF,
            0x018 => {
                self.tick.base = now;
                self.tick.control &= !(1 << 16);
            }
            0x100..=0x11C => self.bits(offset, 0x100, |s, w| s.enabled[w] |= value)?,
            0x180..=0x19C => self.bits(offset, 0x180, |s, w| s.enabled[w] &= !value)?,
            0x200..=0x21C => self.bits(offset, 0x200, |s, w| s.pending[w] |= value)?,
            0x280..=0x29C => self.bits(offset, 0x280, |s, w| s.pending[w] &= !value)?,
            0xD04 => {
                if value & 1 << 31 != 0 {
                    return told("NMI by software is not modelled");
                }
                for (set, clear, exception) in [(28, 27, PEND_SV), (26, 25, SYS_TICK)] {
                    if value & 1 << set != 0 {
                        self.system_pending |= 1 << exception;
                    }
                    if value & 1 << clear != 0 {
                        self.system_pending &= !(1 << exception);
                    }
                }
            }
            0xD08 => self.vectors = value & 0xFFFF_FF80,
            0xD0C => {
                if value >> 16 == 0x05FA {
                    self.grouping = value >> 8 & 7;
                    self.reset_requested = value & 4 != 0;
                }
            }
            0xD10 => {
                if value & 4 != 0 {
                    return told("deep sleep (stop and standby modes) is not modelled");
                }
                self.sleep = value;
            }
            0xD14 => self.configuration = value,
            0xD24 => {
                if value & 0x7_0000 != 0 {
                    return told("handlers of single faults are not modelled: all go to HardFault");
                }
                self.handlers = value;
            }
            0xD28 => self.fault_status[0] &= !value,
            0xD2C => self.fault_status[1] &= !value,
            0xD88 => self.coprocessors = value,
            0xD94 if value & 1 != 0 => return told("the MPU is not modelled"),
            0xD94..=0xDA0 => {
                if let Some(slot) = self.mpu.get_mut((offset - 0xD94) as usize / 4) {
                    *slot = value;
                }
            }
            0xDFC => self.debug = value,
            0xF00 => self.pend(16 + (value & 0x1FF) as u16),
            0xF34 => self.float_context = value,
            0xF3C => self.float_default = value,
            _ => return Err(Refusal::NoRegister),
        }
        self.choose();
        Ok(())
    }

    fn bits(
        &mut self,
        offset: u32,
        base: u32,
        change: impl FnOnce(&mut Self, usize),
    ) -> Result<(), Refusal> {
        let word = (offset - base) as usize / 4;
        if word < WORDS {
            change(self, word);
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod test {
    use super::*;

    fn with(priorities: &[(u32, u8)]) -> Nvic {
        let mut nvic = Nvic::default();
        for (irq, priority) in priorities {
            nvic.write(0, 24, 0x400 + irq, 1, u32::from(*priority))
                .unwrap();
            nvic.write(0, 24, 0x100 + 4 * (irq / 32), 4, 1 << (irq % 32))
                .unwrap();
        }
        nvic
    }

    fn line(irq: u32) -> [u32; WORDS] {
        let mut lines = [0; WORDS];
        lines[irq as usize / 32] = 1 << (irq % 32);
        lines
    }

    #[test]
    fn the_more_urgent_preempts_and_an_equal_one_waits() {
        let mut nvic = with(&[(18, 0x20), (24, 0x10), (91, 0x20)]);
        nvic.set_lines(line(18));
        assert_eq!(nvic.next(Masks::default()), Some(34));
        nvic.enter(34);
        nvic.pend(16 + 91);
        assert_eq!(nvic.next(Masks::default()), None, "same priority");
        nvic.pend(16 + 24);
        assert_eq!(nvic.next(Masks::default()), Some(40));
        nvic.enter(40);
        assert_eq!(nvic.depth(), 2);
        assert_eq!(nvic.leave(), Some(40));
        nvic.set_lines([0; WORDS]);
        assert_eq!(nvic.leave(), Some(34));
        assert_eq!(nvic.next(Masks::default()), Some(107), "tail-chained");
    }

    #[test]
    fn masks() {
        let mut nvic = with(&[(18, 0x20)]);
        nvic.pend(34);
        let primask = Masks {
            primask: true,
            ..Masks::default()
        };
        assert_eq!(nvic.next(primask), None);
        assert!(nvic.wakes(primask));
        let basepri = |value| Masks {
            basepri: value,
            ..Masks::default()
        };
        assert_eq!(nvic.next(basepri(0x20)), None);
        assert_eq!(nvic.next(basepri(0x30)), Some(34));
        nvic.pend(HARD_FAULT);
        assert_eq!(nvic.next(primask), Some(HARD_FAULT));
    }

    #[test]
    fn a_line_that_stays_up_comes_again_and_one_that_fell_does_not() {
        let mut nvic = with(&[(18, 0x20)]);
        nvic.set_lines(line(18));
        nvic.enter(34);
        assert_eq!(nvic.next(Masks::default()), None);
        nvic.leave();
        assert_eq!(nvic.next(Masks::default()), Some(34));
        nvic.enter(34);
        nvic.set_lines([0; WORDS]);
        nvic.leave();
        assert_eq!(nvic.next(Masks::default()), None);
    }

    #[test]
    fn systick_pends_at_its_period() {
        let mut nvic = Nvic::default();
        nvic.write(0, 24, 0x014, 4, 169_999).unwrap();
        nvic.write(0, 24, 0x010, 4, 7).unwrap();
        assert_eq!(nvic.due(), 170_000 * 24);
        nvic.advance(170_000 * 24);
        assert_eq!(nvic.next(Masks::default()), Some(SYS_TICK));
        assert_eq!(nvic.read(170_000 * 24, 0x010).unwrap() >> 16, 1);
    }
}
