//! The chip: time, clocks, peripherals and the lines between them, behind the processor's bus.

use thiserror::Error;

use crate::accelerator::Accelerator;
use crate::board::{Board, Bridge};
use crate::cost::{REFILL, WAIT_STATES};
use crate::cpu::{Block, Bus, Masks, Memory, Work};
use crate::map::{self, Peripheral};
use crate::nvic::Nvic;
use crate::peripheral::adc::Adc;
use crate::peripheral::dma::Dma;
use crate::peripheral::dmamux::Dmamux;
use crate::peripheral::exti::Exti;
use crate::peripheral::flash::Flash;
use crate::peripheral::gpio::{Function, Gpio};
use crate::peripheral::iwdg::Iwdg;
use crate::peripheral::lpuart::Lpuart;
use crate::peripheral::pwr::Pwr;
use crate::peripheral::rcc::{Cause, Crystal, Rcc};
use crate::peripheral::syscfg::Syscfg;
use crate::peripheral::tim::Tim;
use crate::peripheral::{Refusal, told};
use crate::ripple::Ripple;
use crate::time::{Instant, UNITS_PER_SECOND, to_seconds};

/// What an access to a peripheral costs beside the load or store itself, cycles: the bridge from AHB to APB.
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

/// What went wrong in the emulated chip.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ChipError {
    /// An access that the model does not have.
    #[error("{access} of {place} by the code at {pc:#010x}: {refusal}")]
    NotModelled {
        /// Load or store.
        access: &'static str,
        /// Peripheral and offset.
        place: String,
        /// First address of the block that did it.
        pc: u32,
        /// Why.
        refusal: Refusal,
    },
    /// Something that happened by itself.
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
    /// When the processor has to stop for an event.
    deadline: Instant,
    /// The run ends here.
    pub limit: Instant,
    /// Nothing runs before this: what holds the processor up from outside.
    pub held_until: Instant,
    /// Address that follows the last block.
    expected: u32,
    /// Last block.
    pub block: u32,
    accelerator: Accelerator,
    waits: bool,
    /// Event register of WFE.
    pub event: bool,
    /// What went wrong first.
    pub failure: Option<ChipError>,
    /// Interrupt controller.
    pub nvic: Nvic,
    rcc: Rcc,
    pwr: Pwr,
    /// Flash controller.
    pub flash: Flash,
    syscfg: Syscfg,
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
    /// The watchdog has bitten.
    pub bitten: bool,
    /// Stores into the flash memory that wait for the controller.
    stores: Vec<(u32, u32, u32)>,
    /// What has changed in the flash memory: first address and bytes, the emulation's to collect.
    pub changed: Vec<(u32, u32)>,
    /// Converter triggers by the timer so far.
    pub triggers: u64,
    /// What surrounds the chip.
    pub board: Board,
    /// Loads from the encoder's counter, the timing of its edges and the converter's results in the control interrupt,
    /// where wanted.
    pub readings: Option<Vec<Reading>>,
}

/// What the firmware read in the control interrupt.
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
    /// A chip at power on.
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

    /// Resets the chip; board and time go on.
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

    /// Pins that the board holds high: the receiving line idle, the fault line released.
    fn set_pins(&mut self) {
        self.gpio[0].set_outside(3, true);
        let fault = self.board.fault_pin();
        self.gpio[1].set_outside(12, fault);
    }

    /// The processor has locked up: an input of the break where it is let through (SYSCFG_CFGR2.CLL).
    pub fn lock_up(&mut self) {
        if self.syscfg.breaks_on_lockup() {
            self.tim[0].set_system_break(true);
            if let Err(refusal) = self.update_bridge(self.work.now) {
                self.fail(ChipError::Hardware(refusal));
            }
        }
    }

    /// A timer by its number.
    pub fn timer(&mut self, number: u8) -> &mut Tim {
        &mut self.tim[timer_index(number)]
    }

    /// Stops at the next block, whatever is due.
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
        // What follows is not what the pipeline holds.
        self.expected = 0;
    }

    /// A sleep that is met again after a pause of the run is no second instruction.
    pub fn uncount_sleep(&mut self) {
        self.work.instructions -= 1;
    }

    /// When the next event is due.
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

    /// Lets happen what is due by now, in order.
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

    /// All that happens at one instant.
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

    /// A timer's pulse to the converter, whose clock must be on by then: a pulse that nobody can take is a mistake in the
    /// order of the start.
    fn trigger_adc(&mut self, source: u32, at: Instant, now: Instant) -> Result<(), Refusal> {
        if !self.rcc.is_clocked(Peripheral::Adc12) {
            return told("a timer's trigger reaches the converter while its clock is off");
        }
        if !self.adc.listens_to(source) {
            return Ok(());
        }
        self.board.align(at);
        if self.board.due() <= now {
            self.board.advance(now);
        }
        self.triggers += 1;
        let (system, kernel) = (self.period, self.rcc.adc_period());
        let codes = self.codes();
        self.adc
            .start_injected(at, system, kernel, &|channel, held| {
                code_of(&codes, channel, held)
            })
    }

    /// Codes on PC0, PC1, PC2 as far as the pins are analogue.
    fn codes(&self) -> Codes {
        let [current, supply, temperature] = core::array::from_fn(|k| {
            (self.gpio[2].function(k as u32) == Function::Analogue).then(|| self.board.code(k))
        });
        Codes {
            current,
            supply,
            temperature,
            ripple: self.board.ripple(),
            middle: self.tim[0].underflow(self.work.now),
        }
    }

    /// Requests of the serial port to the DMA.
    fn serve_dma(&mut self, at: Instant, memory: &mut dyn Memory) -> Result<(), Refusal> {
        while self.lpuart.has_byte()
            && let Some((controller, channel)) = self.dmamux.channel_of(REQUEST_RX)
            && self.dma[usize::from(controller) - 1].armed(channel) == Some(false)
        {
            let byte = self.lpuart.read(0x24)? as u8;
            if let Some(item) = self.dma[usize::from(controller) - 1].serve(channel)? {
                memory.store(item.memory, &[byte]);
            }
        }
        while self.lpuart.wants_byte()
            && let Some((controller, channel)) = self.dmamux.channel_of(REQUEST_TX)
            && self.dma[usize::from(controller) - 1].armed(channel) == Some(true)
        {
            if let Some(item) = self.dma[usize::from(controller) - 1].serve(channel)? {
                let mut byte = [0];
                memory.load(item.memory, &mut byte);
                self.lpuart.write(at, 0x28, byte[0].into())?;
            }
        }
        Ok(())
    }

    /// The crystal may stop. Watched, it is replaced by the chip's own oscillator, which tells by the non-maskable interrupt;
    /// not watched, the clock that comes from it stands.
    fn watch_crystal(&mut self) -> Result<(), Refusal> {
        match self.rcc.set_crystal(!self.board.faults.crystal_dead) {
            Crystal::Unchanged => Ok(()),
            Crystal::Replaced => {
                self.nvic.pend(NON_MASKABLE);
                self.clocks_changed()
            }
            Crystal::Lost => {
                told("the clock stands: its crystal has stopped, and nobody watches it")
            }
        }
    }

    /// The pins that the board drives.
    fn update_pins(&mut self) {
        let high = self.board.fault_pin();
        if self.gpio[1].set_outside(12, high) && self.syscfg.port_of(12) == 1 {
            self.exti.edge(12, high);
        }
        if self.gpio[1].function(12) == Function::Alternate(6) {
            self.tim[0].set_break_pin(high);
        }
        let low = self.board.faults.logic_supply;
        let low = low.is_some_and(|supply| self.pwr.detects_low(supply));
        let break_down = low && self.syscfg.breaks_on_low_supply();
        // The clock's failure acts whatever SYSCFG says.
        self.tim[0].set_system_break(break_down || self.rcc.clock_failed());
    }

    /// What PWM and enable pin make of the bridge. PA8 and PA9 by alternate function 6 (DS12288 table 13).
    fn update_bridge(&mut self, now: Instant) -> Result<(), Refusal> {
        let mut half = [0.0; 2];
        for (k, level) in half.iter_mut().enumerate() {
            let pin = 8 + k as u32;
            *level = match self.gpio[0].function(pin) {
                Function::Alternate(6) => self.tim[0].output(k)?.unwrap_or(0.0),
                Function::Output => f64::from(u8::from(self.gpio[0].drives_high(pin))),
                _ => 0.0,
            };
        }
        let enabled = self.gpio[1].drives_high(5);
        self.board.set_bridge(
            now,
            Bridge {
                duty: half[0] - half[1],
                enabled,
            },
        );
        Ok(())
    }

    /// The interrupt lines as they stand.
    fn set_lines(&mut self) {
        let mut lines = [0_u32; 4];
        let mut raise = |number: u32, up: bool| {
            lines[number as usize / 32] |= u32::from(up) << (number % 32);
        };
        for (tim, number) in self.tim.iter().zip(TIMERS) {
            let [brk, update, trigger, compare] = tim.requests();
            if !(brk || update || trigger || compare) {
                continue;
            }
            let numbers: [u32; 4] = match number {
                1 => [24, 25, 26, 27],
                2 => [28; 4],
                3 => [29; 4],
                4 => [30; 4],
                5 => [50; 4],
                6 => [54; 4],
                7 => [55; 4],
                8 => [43, 44, 45, 46],
                15 => [24; 4],
                16 => [25; 4],
                17 => [26; 4],
                _ => [77, 78, 79, 80],
            };
            for (number, up) in numbers.into_iter().zip([brk, update, trigger, compare]) {
                raise(number, up);
            }
        }
        raise(ADC1_2, self.adc.requests());
        raise(91, self.lpuart.requests());
        raise(4, self.flash.requests());
        const CHANNELS: [[u32; 8]; 2] = [
            [11, 12, 13, 14, 15, 16, 17, 96],
            [56, 57, 58, 59, 60, 97, 98, 99],
        ];
        for (dma, numbers) in self.dma.iter().zip(CHANNELS) {
            for (channel, number) in numbers.into_iter().enumerate() {
                raise(number, dma.requests(channel));
            }
        }
        let external = self.exti.pending();
        if external != 0 {
            for line in 0..5 {
                raise(6 + line, external & 1 << line != 0);
            }
            raise(23, external & 0x03E0 != 0);
            raise(40, external & 0xFC00 != 0);
        }
        self.nvic.set_lines(lines);
    }

    /// The encoder's edges up to now, into the timers that count and time them: PA0 and PA1 by alternate function 1.
    fn count_edges(&mut self) {
        let edges = self.board.edges(self.work.now);
        let wired = (0..2).all(|pin| self.gpio[0].function(pin) == Function::Alternate(1));
        if wired {
            let tim = self.timer(2);
            tim.quadrature(edges.counts);
            if let Some(index) = edges.index {
                tim.index(index.upwards, index.since);
            }
            if let Some(last) = edges.last
                && tim.sends_encoder_clock()
            {
                self.timer(5).internal_trigger_1(last);
            }
        }
    }

    fn clocks_changed(&mut self) -> Result<(), Refusal> {
        let system = self.rcc.system_clock()?;
        if system > self.pwr.fastest() {
            return told(format!(
                "a system clock of {system} Hz at a core voltage for {} Hz",
                self.pwr.fastest()
            ));
        }
        // One wait state per 34 MHz in boost (RM0440 table 29), per 30 MHz in normal range 1.
        let step = if self.pwr.fastest() > 150_000_000 {
            34_000_000
        } else {
            30_000_000
        };
        let needed = system.div_ceil(step) - 1;
        if u64::from(self.flash.latency()) < needed {
            return told(format!(
                "a system clock of {system} Hz needs {needed} wait states of the flash memory, {} are set",
                self.flash.latency()
            ));
        }
        self.period = self.rcc.system_period()?;
        self.waits = needed > 0;
        let now = self.work.now;
        for (tim, number) in self.tim.iter_mut().zip(TIMERS) {
            tim.set_clock(now, self.rcc.timer_period(number)?);
        }
        if let Ok(period) = self.rcc.lpuart_period() {
            self.lpuart.set_clock(period);
        }
        Ok(())
    }

    fn load(&mut self, address: u32, size: u32) -> Result<u32, Refusal> {
        let now = self.work.now;
        let (peripheral, base) = self.place(address)?;
        let offset = (address - base) & !3;
        let word = match peripheral {
            Peripheral::Tim(number) => {
                let tim = &mut self.tim[timer_index(number)];
                tim.advance(now);
                if matches!(number, 2 | 5) {
                    self.count_edges();
                }
                self.tim[timer_index(number)].read(now, offset)?
            }
            Peripheral::Iwdg => self.iwdg.read(offset)?,
            Peripheral::Pwr => self.pwr.read(offset)?,
            Peripheral::Lpuart => self.lpuart.read(offset)?,
            Peripheral::Syscfg => self.syscfg.read(offset)?,
            Peripheral::Exti => self.exti.read(offset)?,
            Peripheral::Dma(n) => self.dma[usize::from(n) - 1].read(offset)?,
            Peripheral::Dmamux => self.dmamux.read(offset)?,
            Peripheral::Rcc => self.rcc.read(offset)?,
            Peripheral::Flash => self.flash.read(offset)?,
            Peripheral::Gpio(n) => self.gpio[usize::from(n)].read(offset)?,
            Peripheral::Adc12 => self.adc.read(now, offset)?,
            Peripheral::Dwt => match offset {
                // CTRL: four comparators, no trace; CYCCNTENA.
                0 => 0x4000_0000 | u32::from(self.cycle_counter.0),
                4 => self.cycles(),
                0xFB4 => 0,
                _ => return Err(Refusal::NoRegister),
            },
            Peripheral::Scs => self.nvic.read(now, offset)?,
            Peripheral::Dbgmcu => match offset {
                // STM32G47xxx, revision Z (RM0440 section 47.6.1).
                0 => 0x2003_6469,
                4..=0x10 => self.debug_unit[offset as usize / 4 - 1],
                _ => return Err(Refusal::NoRegister),
            },
        };
        let shifted = word >> (8 * (address & 3));
        Ok(match size {
            1 => shifted & 0xFF,
            2 => shifted & 0xFFFF,
            _ => shifted,
        })
    }

    /// The cycle counter: it counts cycles asleep as well.
    fn cycles(&self) -> u32 {
        if self.cycle_counter.0 {
            (self.work.now / self.period).wrapping_sub(self.cycle_counter.1) as u32
        } else {
            self.cycle_counter.1 as u32
        }
    }

    fn place(&self, address: u32) -> Result<(Peripheral, u32), Refusal> {
        let (peripheral, base) = map::peripheral(address).ok_or(Refusal::NoRegister)?;
        if !self.rcc.is_clocked(peripheral) {
            return told("the peripheral's clock is off");
        }
        if self.rcc.is_held(peripheral) {
            return told("the peripheral is held in reset");
        }
        Ok((peripheral, base))
    }

    fn store(&mut self, address: u32, size: u32, value: u32) -> Result<(), Refusal> {
        let now = self.work.now;
        let (peripheral, base) = self.place(address)?;
        let offset = address - base;
        // Timers may be accessed by half-words (RM0440 section 28.6); the line takes single bytes.
        let narrow = match peripheral {
            Peripheral::Scs | Peripheral::Lpuart => true,
            Peripheral::Tim(_) => size == 2,
            _ => false,
        };
        if size != 4 && !(narrow && (offset.is_multiple_of(4) || peripheral == Peripheral::Scs)) {
            return told(format!("a store of {size} bytes is not modelled there"));
        }
        match peripheral {
            Peripheral::Tim(number) => {
                let tim = &mut self.tim[timer_index(number)];
                tim.advance(now);
                if matches!(number, 2 | 5) {
                    self.count_edges();
                }
                let ran = self.timer(1).sends_enable();
                self.timer(number).write(now, offset, value)?;
                if !ran && self.timer(1).sends_enable() {
                    self.timer(4).internal_trigger_0(now);
                }
            }
            Peripheral::Iwdg => self.iwdg.write(now, offset, value)?,
            Peripheral::Pwr => self.pwr.write(offset, value)?,
            Peripheral::Lpuart => self.lpuart.write(now, offset, value)?,
            Peripheral::Syscfg => self.syscfg.write(offset, value)?,
            Peripheral::Exti => self.exti.write(offset, value)?,
            Peripheral::Dma(n) => self.dma[usize::from(n) - 1].write(offset, value)?,
            Peripheral::Dmamux => self.dmamux.write(offset, value)?,
            Peripheral::Rcc => {
                let changed = self.rcc.write(offset, value)?;
                if Rcc::is_reset(offset) {
                    self.reset_held();
                }
                if changed {
                    self.clocks_changed()?;
                }
            }
            Peripheral::Flash => self.flash.write(now, offset, value)?,
            Peripheral::Gpio(n) => self.gpio[usize::from(n)].write(offset, value)?,
            Peripheral::Adc12 => {
                let (system, kernel) = (self.period, self.rcc.adc_period());
                let codes = self.codes();
                self.adc
                    .write(now, offset, value, system, kernel, &|channel, held| {
                        code_of(&codes, channel, held)
                    })?;
            }
            Peripheral::Dwt => match offset {
                0 => {
                    let count = u64::from(self.cycles());
                    let on = value & 1 != 0;
                    let cycle = now / self.period;
                    self.cycle_counter = (on, if on { cycle.wrapping_sub(count) } else { count });
                }
                4 => {
                    let cycle = now / self.period;
                    let start = if self.cycle_counter.0 {
                        cycle.wrapping_sub(value.into())
                    } else {
                        value.into()
                    };
                    self.cycle_counter.1 = start;
                }
                // LAR: no lock on this core.
                0xFB0 => {}
                _ => return Err(Refusal::NoRegister),
            },
            Peripheral::Scs => self.nvic.write(now, self.period, offset, size, value)?,
            Peripheral::Dbgmcu => match offset {
                4..=0x10 => self.debug_unit[offset as usize / 4 - 1] = value,
                _ => return Err(Refusal::NoRegister),
            },
        }
        if matches!(peripheral, Peripheral::Tim(1) | Peripheral::Gpio(_)) {
            self.update_pins();
            self.update_bridge(now)?;
        }
        Ok(())
    }

    /// Peripherals whose reset bit is set start anew.
    fn reset_held(&mut self) {
        for (k, number) in TIMERS.into_iter().enumerate() {
            if self.rcc.is_held(Peripheral::Tim(number)) {
                let clock = self.rcc.timer_period(number).unwrap_or(self.period);
                self.tim[k] = Tim::new(number, clock);
            }
        }
        for n in 0..7 {
            if self.rcc.is_held(Peripheral::Gpio(n)) {
                let fresh = Gpio::new(n);
                self.gpio[usize::from(n)] = fresh;
            }
        }
        for n in 1..=2 {
            if self.rcc.is_held(Peripheral::Dma(n)) {
                self.dma[usize::from(n) - 1] = Dma::default();
            }
        }
        if self.rcc.is_held(Peripheral::Dmamux) {
            self.dmamux = Dmamux::default();
        }
        if self.rcc.is_held(Peripheral::Adc12) {
            self.adc = Adc::default();
        }
        if self.rcc.is_held(Peripheral::Lpuart) {
            self.lpuart.reset();
            if let Ok(period) = self.rcc.lpuart_period() {
                self.lpuart.set_clock(period);
            }
        }
        self.set_pins();
    }

    fn refused(&mut self, access: &'static str, address: u32, refusal: Refusal) {
        self.fail(ChipError::NotModelled {
            access,
            place: map::name(address),
            pc: self.block,
            refusal,
        });
    }

    fn charge_bridge(&mut self, address: u32) {
        if address < 0xE000_0000 {
            self.work.cycles += BRIDGE;
            self.work.bridge += BRIDGE;
            self.work.now += BRIDGE * self.period;
        }
    }

    /// Bytes that the host puts on the serial line now. They reach the port only where PA3 is set up for it.
    pub fn send(&mut self, bytes: &[u8]) {
        if self.gpio[0].function(3) == Function::Alternate(12) {
            self.lpuart.receive(self.work.now, bytes);
            self.deadline = 0;
        }
    }

    /// Bytes that have gone out on PA2 since the last call.
    pub fn take_sent(&mut self) -> Vec<u8> {
        core::mem::take(&mut self.lpuart.sent)
    }
}

/// What is on the converter's pins: codes, and what the current's varies by within a pulse.
struct Codes {
    current: Option<u16>,
    supply: Option<u16>,
    temperature: Option<u16>,
    ripple: Ripple,
    /// Middle of a braking interval, while the pulses come.
    middle: Option<Instant>,
}

fn code_of(codes: &Codes, channel: u32, held: Instant) -> Option<u16> {
    match channel {
        6 => codes.current.map(|code| match codes.middle {
            Some(middle) => codes.ripple.on(code, to_seconds(held) - to_seconds(middle)),
            None => code,
        }),
        7 => codes.supply,
        8 => codes.temperature,
        // VREFINT of 1.212 V (DS12288 table 21) at 3.3 V.
        18 => Some(1504),
        _ => None,
    }
}

impl Bus for Chip {
    fn block(&mut self, block: &Block, masks: &dyn Fn() -> Masks) -> bool {
        if self.work.now >= self.deadline
            || self.failure.is_some()
            || !self.stores.is_empty()
            || self.nvic.reset_requested
        {
            return false;
        }
        if self.nvic.is_interested() && self.nvic.next(masks()).is_some() {
            return false;
        }
        if let Some(end) = self.flash.stalls(block.address)
            && end > self.work.now
        {
            self.work.now = end.min(self.deadline);
            return false;
        }
        let mut cycles = u64::from(block.cycles);
        if block.address != self.expected {
            cycles += REFILL;
            self.work.refills += REFILL;
        }
        if self.waits && map::FLASH.contains(&block.address) {
            let lost = if self.flash.caches() {
                self.accelerator.fetch(
                    block.address,
                    block.size.into(),
                    block.cycles.into(),
                    self.flash.prefetches(),
                    block.address == self.expected,
                )
            } else {
                u64::from(block.size).div_ceil(8) * WAIT_STATES
            };
            cycles += lost;
            self.work.fetches += lost;
        }
        self.expected = block.address + u32::from(block.size);
        self.block = block.address;
        self.work.instructions += u64::from(block.instructions);
        self.work.cycles += cycles;
        self.work.now += cycles * self.period;
        self.event |= block.event;
        if block.float && !self.nvic.float_enabled() {
            self.fail(ChipError::FloatOff(block.address));
        }
        true
    }

    fn read(&mut self, memory: &mut dyn Memory, address: u32, size: u32) -> u32 {
        self.charge_bridge(address);
        self.settle(memory);
        match self.load(address, size) {
            Ok(value) => {
                if let Some(readings) = &mut self.readings
                    && self.nvic.running() == Some(CONTROL_EXCEPTION)
                    && matches!(
                        address,
                        0x4000_0024 | 0x4000_0C24 | 0x4000_0C34 | 0x5000_0080..=0x5000_008C
                    )
                {
                    readings.push(Reading {
                        address,
                        value,
                        trigger: self.triggers,
                    });
                }
                self.set_lines();
                value
            }
            Err(refusal) => {
                self.refused("a load", address, refusal);
                0
            }
        }
    }

    fn write(&mut self, memory: &mut dyn Memory, address: u32, size: u32, value: u32) {
        self.charge_bridge(address);
        self.settle(memory);
        if let Err(refusal) = self.store(address, size, value) {
            self.refused("a store", address, refusal);
        }
        if let Err(refusal) = self.serve_dma(self.work.now, memory) {
            self.fail(ChipError::Hardware(refusal));
        }
        self.set_lines();
        self.deadline = self.deadline.min(self.next_event().max(1));
    }

    fn flash_write(&mut self, address: u32, size: u32, value: u32) {
        self.stores.push((address, size, value));
    }
}
