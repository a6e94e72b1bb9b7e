//! The processor's side: the effects of a load, a store and a block of instructions.

use super::error::ChipError;
use super::pins::code_of;
use super::state::{BRIDGE, CONTROL_EXCEPTION, Chip, Reading, TIMERS, timer_index};
use crate::cost::{REFILL, WAIT_STATES};
use crate::cpu::{Block, Bus, Masks, Memory};
use crate::map::{self, Peripheral};
use crate::peripheral::adc::Adc;
use crate::peripheral::comp::Comp;
use crate::peripheral::dac::Dac;
use crate::peripheral::dma::Dma;
use crate::peripheral::dmamux::Dmamux;
use crate::peripheral::gpio::Gpio;
use crate::peripheral::rcc::Rcc;
use crate::peripheral::syscfg::Syscfg;
use crate::peripheral::tim::Tim;
use crate::peripheral::{Refusal, told};

impl Chip {
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
            Peripheral::Wwdg => self.wwdg.read(now, offset)?,
            Peripheral::Pwr => self.pwr.read(offset)?,
            Peripheral::Lpuart => self.lpuart.read(offset)?,
            Peripheral::Syscfg => self.syscfg.read(offset)?,
            Peripheral::Exti => self.exti.read(offset)?,
            Peripheral::Dma(n) => self.dma[usize::from(n) - 1].read(offset)?,
            Peripheral::Dmamux => self.dmamux.read(offset)?,
            Peripheral::Rcc => self.rcc.read(offset)?,
            Peripheral::Flash => self.flash.read(offset)?,
            Peripheral::Gpio(n) => {
                if n == 0 {
                    self.count_edges();
                }
                self.gpio[usize::from(n)].read(offset)?
            }
            Peripheral::Comp => self.comp.read(offset)?,
            Peripheral::Dac3 => self.dac.read(offset)?,
            // ADRDY, its first bit.
            Peripheral::Adc12 if offset == 0 && self.board.faults.converter_dead => {
                self.adc.read(now, offset)? & !1
            }
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

    /// Returns the cycle counter. It also counts cycles asleep.
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
            Peripheral::Tim(number) => self.store_timer(number, offset, value)?,
            Peripheral::Iwdg => self.iwdg.write(now, offset, value)?,
            Peripheral::Wwdg => {
                let clock = self.rcc.apb1_period()?;
                self.wwdg.write(now, clock, offset, value)?;
            }
            Peripheral::Pwr => self.store_power(offset, value)?,
            Peripheral::Lpuart => self.lpuart.write(now, offset, value)?,
            Peripheral::Syscfg => self.syscfg.write(offset, value)?,
            Peripheral::Exti => self.exti.write(offset, value)?,
            Peripheral::Dma(n) => self.dma[usize::from(n) - 1].write(offset, value)?,
            Peripheral::Dmamux => self.dmamux.write(offset, value)?,
            Peripheral::Rcc => self.store_clocks(offset, value)?,
            Peripheral::Flash => self.flash.write(now, offset, value)?,
            Peripheral::Gpio(n) => self.store_port(n, offset, value)?,
            Peripheral::Comp => self.comp.write(offset, value)?,
            Peripheral::Dac3 => self.dac.write(offset, value)?,
            Peripheral::Adc12 => self.store_converter(offset, value)?,
            Peripheral::Dwt => self.store_cycles(offset, value)?,
            Peripheral::Scs => self.nvic.write(now, self.period, offset, size, value)?,
            Peripheral::Dbgmcu => match offset {
                4..=0x10 => self.debug_unit[offset as usize / 4 - 1] = value,
                _ => return Err(Refusal::NoRegister),
            },
        }
        if matches!(
            peripheral,
            Peripheral::Tim(1) | Peripheral::Gpio(_) | Peripheral::Comp | Peripheral::Dac3
        ) {
            self.update_pins();
            self.update_bridge(now)?;
        }
        Ok(())
    }

    /// Stores to a timer.
    fn store_timer(&mut self, number: u8, offset: u32, value: u32) -> Result<(), Refusal> {
        let now = self.work.now;
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
        Ok(())
    }

    /// Stores to the clock control.
    fn store_clocks(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        let changed = self.rcc.write(offset, value)?;
        if Rcc::is_reset(offset) {
            self.reset_held();
        }
        // A reset of the power control or of the flash interface changes core voltage or wait states.
        if changed || Rcc::is_reset(offset) {
            self.clocks_changed()?;
        }
        Ok(())
    }

    /// Stores to the power control: the clock must suit the core voltage afterwards too.
    fn store_power(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        self.pwr.write(offset, value)?;
        self.clocks_changed()
    }

    /// Stores to a port of pins.
    fn store_port(&mut self, n: u8, offset: u32, value: u32) -> Result<(), Refusal> {
        // Counts up to now use the pulls up to now.
        if n == 0 {
            self.count_edges();
        }
        self.gpio[usize::from(n)].write(offset, value)?;
        if n == 0 {
            self.count_edges();
        }
        Ok(())
    }

    /// Stores to the converter.
    fn store_converter(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        let now = self.work.now;
        let (system, kernel) = (self.period, self.rcc.adc_period());
        let codes = self.codes();
        self.adc
            .write(now, offset, value, system, kernel, &|channel, held| {
                code_of(&codes, channel, held)
            })
    }

    /// Stores to the cycle counter.
    fn store_cycles(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        let now = self.work.now;
        match offset {
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
        }
        Ok(())
    }

    /// Resets the peripherals whose reset bit is set.
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
        if self.rcc.is_held(Peripheral::Pwr) {
            self.pwr.reset();
        }
        if self.rcc.is_held(Peripheral::Flash) {
            self.flash.reset();
        }
        if self.rcc.is_held(Peripheral::Syscfg) {
            self.syscfg = Syscfg::default();
            self.comp = Comp::default();
        }
        if self.rcc.is_held(Peripheral::Dac3) {
            self.dac = Dac::default();
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
