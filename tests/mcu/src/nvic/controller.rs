//! The interrupt controller.

use crate::cpu::Masks;
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

pub(super) const WORDS: usize = INTERRUPTS.div_ceil(32);
/// Priority of thread mode with nothing masked.
const THREAD: i16 = 256;

#[derive(Clone, Debug, Default)]
pub(super) struct SysTick {
    pub(super) control: u32,
    pub(super) reload: u32,
    /// Start of the present count, at `reload`.
    pub(super) base: Instant,
    pub(super) period: u64,
}

/// The interrupt controller with the system control block.
#[derive(Clone, Debug)]
pub struct Nvic {
    pub(super) enabled: [u32; WORDS],
    pub(super) pending: [u32; WORDS],
    level: [u32; WORDS],
    pub(super) priority: [u8; 16 + INTERRUPTS],
    /// Pending system exceptions, by number.
    pub(super) system_pending: u16,
    /// Active exceptions, the running one last.
    pub(super) active: Vec<u16>,
    pub(super) tick: SysTick,
    pub(super) vectors: u32,
    pub(super) sleep: u32,
    pub(super) configuration: u32,
    pub(super) handlers: u32,
    pub(super) grouping: u32,
    pub(super) coprocessors: u32,
    pub(super) float_context: u32,
    pub(super) float_default: u32,
    pub(super) fault_status: [u32; 4],
    pub(super) debug: u32,
    /// DFSR: debug events since it was cleared.
    pub debug_status: u32,
    pub(super) mpu: [u32; 4],
    /// Reset has been requested by AIRCR.
    pub reset_requested: bool,
    /// The most urgent pending exception, and its priority.
    pub(super) candidate: Option<(u16, i16)>,
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
            debug_status: 0,
            mpu: [0; 4],
            reset_requested: false,
            candidate: None,
        }
    }
}

impl Nvic {
    /// Returns the address of the vector table.
    pub fn vectors(&self) -> u32 {
        self.vectors
    }

    /// Returns true if the floating-point unit may be used (CPACR, full access to CP10 and CP11).
    pub fn float_enabled(&self) -> bool {
        self.coprocessors >> 20 & 0xF == 0xF
    }

    /// Returns FPDSCR: the initial FPSCR of a new context.
    pub fn float_default(&self) -> u32 {
        self.float_default
    }

    /// Returns true if SCR.SEVONPEND is set.
    pub fn pending_wakes(&self) -> bool {
        self.sleep & 0x10 != 0
    }

    /// Returns true if SCR.SLEEPONEXIT is set.
    pub fn sleeps_on_exit(&self) -> bool {
        self.sleep & 2 != 0
    }

    /// Returns the running exception; `None` in thread mode.
    pub fn running(&self) -> Option<u16> {
        self.active.last().copied()
    }

    /// Returns the number of nested exceptions.
    pub fn depth(&self) -> usize {
        self.active.len()
    }

    /// Returns the group priority of an exception.
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

    /// Returns the part of a priority that decides on preemption (AIRCR.PRIGROUP). Four bits are implemented.
    fn group(&self, raw: u8) -> i16 {
        let split = self.grouping + 1;
        i16::from(raw & 0xF0) & !((1 << split) - 1)
    }

    /// Returns the priority at which the processor runs.
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

    /// Finds the most urgent pending exception.
    pub(super) fn choose(&mut self) {
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

    /// Returns the pending bits: latched, or from a line that is up while its handler does not run.
    pub(super) fn effective(&self, word: usize) -> u32 {
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

    /// Sets the levels of the interrupt lines.
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

    /// Returns true if a pending exception could preempt the running one with no masks set.
    pub fn is_interested(&self) -> bool {
        self.candidate
            .is_some_and(|(_, priority)| self.running_priority(Masks::default()) > priority)
    }

    /// Returns the exception to take now, if any.
    pub fn next(&self, masks: Masks) -> Option<u16> {
        let (exception, priority) = self.candidate?;
        (priority < self.running_priority(masks)).then_some(exception)
    }

    /// Returns true if WFI ends: PRIMASK is ignored (B1.5.19).
    pub fn wakes(&self, masks: Masks) -> bool {
        self.next(Masks {
            primask: false,
            ..masks
        })
        .is_some()
    }

    /// Returns true if any enabled exception is pending, at any priority.
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

    /// Returns the next instant at which SysTick counts to zero.
    pub fn due(&self) -> Instant {
        if self.tick.control & 3 == 3 && self.tick.reload != 0 {
            self.tick.base + (u64::from(self.tick.reload) + 1) * self.tick.period
        } else {
            NEVER
        }
    }

    /// Advances SysTick.
    pub fn advance(&mut self, now: Instant) {
        while self.due() <= now {
            self.tick.base = self.due();
            self.tick.control |= 1 << 16;
            self.pend(SYS_TICK);
        }
    }

    /// Records a fault with its status, address and cause for CFSR.
    pub fn fault(&mut self, status: u32, address: u32) {
        self.fault_status[0] |= status;
        // FORCED.
        self.fault_status[1] |= 1 << 30;
        self.fault_status[3] = address;
    }
}
