//! The state of the chip.

use super::error::ChipError;
use crate::accelerator::Accelerator;
use crate::board::Board;
use crate::cpu::Work;
use crate::nvic::Nvic;
use crate::peripheral::adc::Adc;
use crate::peripheral::comp::Comp;
use crate::peripheral::dac::Dac;
use crate::peripheral::dma::Dma;
use crate::peripheral::dmamux::Dmamux;
use crate::peripheral::exti::Exti;
use crate::peripheral::flash::Flash;
use crate::peripheral::gpio::Gpio;
use crate::peripheral::iwdg::Iwdg;
use crate::peripheral::lpuart::Lpuart;
use crate::peripheral::pwr::Pwr;
use crate::peripheral::rcc::{Cause, Rcc};
use crate::peripheral::syscfg::Syscfg;
use crate::peripheral::tim::Tim;
use crate::peripheral::wwdg::Wwdg;
use crate::time::Instant;

/// Additional cost of an access to a peripheral, cycles: the bridge from AHB to APB.
pub(super) const BRIDGE: u64 = 3;
/// Timers of the chip.
pub(super) const TIMERS: [u8; 12] = [1, 2, 3, 4, 5, 6, 7, 8, 15, 16, 17, 20];
/// Interrupt numbers (RM0440 table 97).
pub(super) const ADC1_2: u32 = 18;
/// The control interrupt's exception number.
pub const CONTROL_EXCEPTION: u16 = 16 + ADC1_2 as u16;
/// DMAMUX requests (RM0440 table 91).
pub(super) const REQUEST_RX: u32 = 34;
pub(super) const REQUEST_TX: u32 = 35;
/// Exception number of the non-maskable interrupt.
pub(super) const NON_MASKABLE: u16 = 2;
/// External triggers of the injected group (RM0440 table 167).
pub(super) const TIM4_TRGO: u32 = 5;
pub(super) const TIM1_TRGO2: u32 = 8;

/// The chip with the board around it.
pub struct Chip {
    /// Time and work.
    pub work: Work,
    /// Units per cycle of the processor.
    pub(super) period: u64,
    /// Time at which the processor has to stop for an event.
    pub(super) deadline: Instant,
    /// End of the run.
    pub limit: Instant,
    /// Time until which something outside holds the processor up.
    pub held_until: Instant,
    /// A halt of the processor by a debugger: its beginning and its end.
    pub(super) halt: Option<[Instant; 2]>,
    /// Address that follows the last block.
    pub(super) expected: u32,
    /// Last block.
    pub block: u32,
    pub(super) accelerator: Accelerator,
    pub(super) waits: bool,
    /// Event register of WFE.
    pub event: bool,
    /// The first error.
    pub failure: Option<ChipError>,
    /// Interrupt controller.
    pub nvic: Nvic,
    pub(super) rcc: Rcc,
    pub(super) pwr: Pwr,
    /// Flash controller.
    pub flash: Flash,
    pub(super) syscfg: Syscfg,
    pub(super) comp: Comp,
    /// Outputs of COMP3 and COMP4 behind their delay.
    pub(super) comparators: [DelayedOutput; 2],
    pub(super) dac: Dac,
    pub(super) exti: Exti,
    pub(super) gpio: [Gpio; 7],
    /// Timers in the order of [`TIMERS`].
    pub(super) tim: [Tim; 12],
    /// Converter.
    pub adc: Adc,
    pub(super) dma: [Dma; 2],
    pub(super) dmamux: Dmamux,
    /// Serial port.
    pub lpuart: Lpuart,
    /// Independent watchdog.
    pub iwdg: Iwdg,
    /// Window watchdog.
    pub(super) wwdg: Wwdg,
    pub(super) cycle_counter: (bool, u64),
    pub(super) debug_unit: [u32; 4],
    /// The watchdog that has reset the chip.
    pub bitten: Option<Cause>,
    /// Stores into the flash memory that wait for the controller.
    pub(super) stores: Vec<(u32, u32, u32)>,
    /// Changes in the flash memory: first address and bytes, for the emulation to collect.
    pub changed: Vec<(u32, u32)>,
    /// Converter triggers by the timer so far.
    pub triggers: u64,
    /// The board around the chip.
    pub board: Board,
    /// If present, collects loads in the control interrupt from the encoder's counter, its edge timing and the
    /// converter's results.
    pub readings: Option<Vec<Reading>>,
}

/// An output that rises late.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DelayedOutput {
    pub(super) high: bool,
    /// Time at which it rises, if it does.
    pub(super) rises: Option<Instant>,
}

/// A value that the firmware read in the control interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Address of the register.
    pub address: u32,
    /// Value.
    pub value: u32,
    /// Converter triggers before it.
    pub trigger: u64,
}

/// Returns the index of a timer by its number.
pub(super) fn timer_index(number: u8) -> usize {
    TIMERS.iter().position(|n| *n == number).unwrap_or(0)
}

impl Chip {
    /// Returns a timer by its number.
    pub fn timer(&mut self, number: u8) -> &mut Tim {
        &mut self.tim[timer_index(number)]
    }

    /// Stops at the next block in any case.
    pub fn interrupt_run(&mut self) {
        self.deadline = 0;
    }

    /// Spends time without work: sleep, or a wait.
    pub fn skip_to(&mut self, instant: Instant) {
        self.work.now = self.work.now.max(instant);
    }

    /// Spends cycles of the processor outside any block: exception entry and return.
    pub fn spend(&mut self, cycles: u64) {
        self.work.cycles += cycles;
        self.work.now += cycles * self.period;
        // The next code is not in the pipeline.
        self.expected = 0;
    }

    /// Uncounts a sleep instruction that is repeated after a pause of the run.
    pub fn uncount_sleep(&mut self) {
        self.work.instructions -= 1;
    }

    /// Records an error; the first one counts.
    pub(super) fn fail(&mut self, error: ChipError) {
        self.failure.get_or_insert(error);
        self.deadline = 0;
    }
}
