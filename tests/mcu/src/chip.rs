//! The chip: time, clocks, peripherals and the lines between them, behind the processor's bus.

mod bus;
mod lines;
mod pins;

use pins::code_of;
use thiserror::Error;

use crate::accelerator::Accelerator;
use crate::board::{Board, Bridge};
use crate::cpu::{Memory, Work};
use crate::nvic::Nvic;
use crate::peripheral::Refusal;
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
use crate::time::{Instant, UNITS_PER_SECOND};

/// Additional cost of an access to a peripheral, cycles: the bridge from AHB to APB.
const BRIDGE: u64 = 3;
/// Timers of the chip.
const TIMERS: [u8; 12] = [1, 2, 3, 4, 5, 6, 7, 8, 15, 16, 17, 20];
/// Interrupt numbers (RM0440 table 97).
const ADC1_2: u32 = 18;
/// The control interrupt's exception number.
pub const CONTROL_EXCEPTION: u16 = 16 + ADC1_2 as u16;
/// DMAMUX requests (RM0440 table 91).
const REQUEST_RX: u32 = 34;
const REQUEST_TX: u32 = 35;
/// Exception number of the non-maskable interrupt.
const NON_MASKABLE: u16 = 2;
/// External triggers of the injected group (RM0440 table 167).
const TIM4_TRGO: u32 = 5;
const TIM1_TRGO2: u32 = 8;

/// Errors of the emulated chip.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ChipError {
    /// An access that is not modelled.
    #[error("{access} of {place} by the code at {pc:#010x}: {refusal}")]
    NotModelled {
        /// Load or store.
        access: &'static str,
        /// Peripheral and offset.
        place: String,
        /// First address of the block with the access.
        pc: u32,
        /// Reason.
        refusal: Refusal,
    },
    /// An error without an access.
    #[error("{0}")]
    Hardware(Refusal),
    /// A floating-point instruction while the unit is off.
    #[error("a floating-point instruction in the code at {0:#010x} while CPACR has the unit off")]
    FloatOff(u32),
}

/// The chip with the board around it.
pub struct Chip {
    /// Time and work.
    pub work: Work,
    /// Units per cycle of the processor.
    period: u64,
    /// Time at which the processor has to stop for an event.
    deadline: Instant,
    /// End of the run.
    pub limit: Instant,
    /// Time until which something outside holds the processor up.
    pub held_until: Instant,
    /// Address that follows the last block.
    expected: u32,
    /// Last block.
    pub block: u32,
    accelerator: Accelerator,
    waits: bool,
    /// Event register of WFE.
    pub event: bool,
    /// The first error.
    pub failure: Option<ChipError>,
    /// Interrupt controller.
    pub nvic: Nvic,
    rcc: Rcc,
    pwr: Pwr,
    /// Flash controller.
    pub flash: Flash,
    syscfg: Syscfg,
    comp: Comp,
    dac: Dac,
    exti: Exti,
    gpio: [Gpio; 7],
    /// Timers in the order of [`TIMERS`].
    tim: [Tim; 12],
    /// Converter.
    pub adc: Adc,
    dma: [Dma; 2],
    dmamux: Dmamux,
    /// Serial port.
    pub lpuart: Lpuart,
    /// Watchdog.
    pub iwdg: Iwdg,
    cycle_counter: (bool, u64),
    debug_unit: [u32; 4],
    /// True if the watchdog has reset the chip.
    pub bitten: bool,
    /// Stores into the flash memory that wait for the controller.
    stores: Vec<(u32, u32, u32)>,
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

fn timer_index(number: u8) -> usize {
    TIMERS.iter().position(|n| *n == number).unwrap_or(0)
}

impl Chip {
    /// Returns a chip at power on.
    pub fn new(board: Board) -> Self {
        let mut chip = Self {
            work: Work::default(),
            period: UNITS_PER_SECOND / 16_000_000,
            deadline: 0,
            limit: 0,
            held_until: 0,
            expected: 0,
            block: 0,
            accelerator: Accelerator::default(),
            waits: false,
            event: false,
            failure: None,
            nvic: Nvic::default(),
            rcc: Rcc::new(Cause::PowerOn),
            pwr: Pwr::default(),
            flash: Flash::default(),
            syscfg: Syscfg::default(),
            comp: Comp::default(),
            dac: Dac::default(),
            exti: Exti::default(),
            gpio: core::array::from_fn(|n| Gpio::new(n as u8)),
            tim: TIMERS.map(|n| Tim::new(n, 255)),
            adc: Adc::default(),
            dma: Default::default(),
            dmamux: Dmamux::default(),
            lpuart: Lpuart::default(),
            iwdg: Iwdg::default(),
            cycle_counter: (false, 0),
            debug_unit: [0; 4],
            bitten: false,
            stores: Vec::new(),
            changed: Vec::new(),
            triggers: 0,
            board,
            readings: None,
        };
        chip.set_pins();
        chip
    }

    /// Resets the chip; board and time continue.
    pub fn reset(&mut self, cause: Cause) {
        self.board.set_bridge(self.work.now, Bridge::default());
        self.period = UNITS_PER_SECOND / 16_000_000;
        self.waits = false;
        self.event = false;
        self.bitten = false;
        self.nvic = Nvic::default();
        self.rcc = Rcc::new(cause);
        self.rcc.set_crystal(!self.board.faults.crystal_dead);
        self.pwr = Pwr::default();
        self.flash = Flash::default();
        self.syscfg = Syscfg::default();
        self.comp = Comp::default();
        self.dac = Dac::default();
        self.exti = Exti::default();
        self.gpio = core::array::from_fn(|n| Gpio::new(n as u8));
        self.tim = TIMERS.map(|n| Tim::new(n, 255));
        self.adc = Adc::default();
        self.dma = Default::default();
        self.dmamux = Dmamux::default();
        self.lpuart.reset();
        self.iwdg = Iwdg::default();
        self.cycle_counter = (false, 0);
        self.stores.clear();
        self.deadline = 0;
        self.set_pins();
    }

    /// Handles a locked-up processor: an input of the break if enabled (SYSCFG_CFGR2.CLL).
    pub fn lock_up(&mut self) {
        if self.syscfg.breaks_on_lockup() {
            self.tim[0].set_system_break(true);
            if let Err(refusal) = self.update_bridge(self.work.now) {
                self.fail(ChipError::Hardware(refusal));
            }
        }
    }

    /// Handles a flash word with two wrong bits in bank 1 or 2: the non-maskable interrupt, and the break if enabled
    /// (SYSCFG_CFGR2.ECCL).
    pub fn flash_error(&mut self, bank: u8) {
        self.flash.double_error(bank);
        self.nvic.pend(NON_MASKABLE);
        if self.syscfg.breaks_on_flash_error() {
            self.tim[0].set_system_break(true);
            if let Err(refusal) = self.update_bridge(self.work.now) {
                self.fail(ChipError::Hardware(refusal));
            }
        }
    }

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

    /// Returns the time of the next event.
    pub fn next_event(&self) -> Instant {
        let mut due = self
            .board
            .due()
            .min(self.adc.due())
            .min(self.lpuart.due())
            .min(self.iwdg.bites())
            .min(self.flash.due())
            .min(self.nvic.due());
        for tim in &self.tim {
            due = due.min(tim.due());
        }
        due
    }

    /// Handles all events that are due, in order.
    pub fn settle(&mut self, memory: &mut dyn Memory) {
        self.settle_stores(memory);
        if self.work.now >= self.deadline {
            loop {
                let due = self.next_event();
                if due > self.work.now {
                    self.deadline = due.min(self.limit);
                    break;
                }
                if let Err(refusal) = self.happen(due, memory) {
                    self.fail(ChipError::Hardware(refusal));
                    break;
                }
                if self.bitten {
                    break;
                }
            }
        }
        self.set_lines();
    }

    fn settle_stores(&mut self, memory: &mut dyn Memory) {
        for (address, size, value) in core::mem::take(&mut self.stores) {
            let now = self.work.now;
            if let Err(refusal) = self.flash.store(now, memory, address, size, value) {
                self.fail(ChipError::Hardware(refusal));
            }
            self.deadline = 0;
        }
    }

    fn fail(&mut self, error: ChipError) {
        self.failure.get_or_insert(error);
        self.deadline = 0;
    }

    /// Handles all events of one instant.
    fn happen(&mut self, at: Instant, memory: &mut dyn Memory) -> Result<(), Refusal> {
        for tim in &mut self.tim {
            tim.advance(at);
        }
        let pulses = [
            (TIM1_TRGO2, self.timer(1).take_trgo2()),
            (TIM4_TRGO, self.timer(4).take_trgo()),
        ];
        for (source, pulse) in pulses {
            if let Some(trigger) = pulse {
                self.trigger_adc(source, trigger, at)?;
            }
        }
        if self.board.due() <= at {
            self.board.advance(at);
        }
        self.watch_crystal()?;
        self.update_pins();
        self.update_bridge(at)?;
        self.adc.advance(at);
        self.lpuart.advance(at);
        self.serve_dma(at, memory)?;
        self.nvic.advance(at);
        if self.flash.due() <= at
            && let Some(changed) = self.flash.finish(memory)
        {
            self.changed.push(changed);
        }
        if self.iwdg.bites() <= at {
            self.bitten = true;
        }
        Ok(())
    }
}
