//! The lines within the chip: interrupts, clocks, triggers, requests to the DMA.

use super::pins::code_of;
use super::state::{ADC1_2, Chip, NON_MASKABLE, REQUEST_RX, REQUEST_TX, TIMERS};
use crate::cpu::Memory;
use crate::map::Peripheral;
use crate::peripheral::rcc::Crystal;
use crate::peripheral::{Refusal, told};
use crate::time::Instant;

impl Chip {
    /// Sets the present levels of the interrupt lines.
    pub(super) fn set_lines(&mut self) {
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
        raise(0, self.wwdg.requests());
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

    pub(super) fn clocks_changed(&mut self) -> Result<(), Refusal> {
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

    /// Serves requests of the serial port to the DMA.
    pub(super) fn serve_dma(
        &mut self,
        at: Instant,
        memory: &mut dyn Memory,
    ) -> Result<(), Refusal> {
        while self.lpuart.has_byte()
            && let Some((controller, channel)) = self.dmamux.channel_of(REQUEST_RX)
            && self.dma[usize::from(controller) - 1].armed(channel) == Some(false)
        {
            let byte = self.lpuart.read(0x24)? as u8;
            if let Some(item) = self.dma[usize::from(controller) - 1].serve(channel)? {
                memory.store(item.memory, &[byte]);
            }
        }
        while !self.board.faults.line_blocked
            && self.lpuart.wants_byte()
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

    /// Passes a timer's pulse to the converter, whose clock must be on: a pulse that is not received is a mistake in
    /// the order of the start.
    pub(super) fn trigger_adc(
        &mut self,
        source: u32,
        at: Instant,
        now: Instant,
    ) -> Result<(), Refusal> {
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
        if self.board.faults.trigger_lost {
            return Ok(());
        }
        self.triggers += 1;
        let (system, kernel) = (self.period, self.rcc.adc_period());
        let codes = self.codes();
        self.adc
            .start_injected(at, system, kernel, &|channel, held| {
                code_of(&codes, channel, held)
            })
    }

    /// Handles a crystal that stops. If watched, the chip's own oscillator replaces it and raises the non-maskable
    /// interrupt. Otherwise the clock from it stops.
    pub(super) fn watch_crystal(&mut self) -> Result<(), Refusal> {
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
}
