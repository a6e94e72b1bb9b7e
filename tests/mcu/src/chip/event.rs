//! Events of the chip, in order of time.

use super::error::ChipError;
use super::state::{Chip, NON_MASKABLE, TIM1_TRGO2, TIM4_TRGO};
use crate::cpu::Memory;
use crate::peripheral::Refusal;
use crate::peripheral::rcc::Cause;
use crate::time::{Instant, NEVER};

impl Chip {
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

    /// Returns the time of the next event.
    pub fn next_event(&self) -> Instant {
        let mut due = self
            .board
            .due()
            .min(self.adc.due())
            .min(self.lpuart.due())
            .min(self.iwdg.bites())
            .min(self.wwdg.due())
            .min(self.flash.due())
            .min(self.nvic.due())
            .min(self.halt.map_or(NEVER, |[_, end]| end));
        for tim in &self.tim {
            due = due.min(tim.due());
        }
        let rises = self.comparators.iter().filter_map(|output| output.rises);
        rises.fold(due, Instant::min)
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
                if self.bitten.is_some() {
                    break;
                }
            }
        }
        self.set_lines();
    }

    /// Passes the stores into the flash memory to its controller.
    fn settle_stores(&mut self, memory: &mut dyn Memory) {
        for (address, size, value) in core::mem::take(&mut self.stores) {
            let now = self.work.now;
            if let Err(refusal) = self.flash.store(now, memory, address, size, value) {
                self.fail(ChipError::Hardware(refusal));
            }
            self.deadline = 0;
        }
    }

    /// Handles all events of one instant.
    fn happen(&mut self, at: Instant, memory: &mut dyn Memory) -> Result<(), Refusal> {
        self.end_halt(at);
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
        self.wwdg.advance(at);
        if self.iwdg.bites() <= at {
            self.bitten = Some(Cause::Watchdog);
        } else if self.wwdg.bites() <= at {
            self.bitten = Some(Cause::WindowWatchdog);
        }
        Ok(())
    }
}
