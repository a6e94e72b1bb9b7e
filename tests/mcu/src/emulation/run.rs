//! The run: instructions, exceptions, sleep and events.

use super::error::EmulationError;
use super::state::Emulation;
use crate::chip::Chip;
use crate::cpu::{Cpu, Register, Stop};
use crate::map;
use crate::nvic::SV_CALL;
use crate::peripheral::rcc::Cause;
use crate::time::{self, Instant, NEVER};

impl<C: Cpu<Chip>> Emulation<C> {
    /// Runs for `seconds`.
    ///
    /// # Errors
    /// The error that ended the run.
    pub fn run_for(&mut self, seconds: f64) -> Result<(), EmulationError> {
        let until = self.cpu.bus().work.now + time::from_seconds(seconds);
        self.run_until(until)
    }

    /// Runs to a point of time.
    ///
    /// # Errors
    /// The error that ended the run; the same again afterwards.
    pub fn run_until(&mut self, until: Instant) -> Result<(), EmulationError> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        let result = self.run(until);
        if let Err(failure) = &result {
            self.failure = Some(failure.clone());
        }
        result
    }

    /// Runs until a point of time or an error.
    fn run(&mut self, until: Instant) -> Result<(), EmulationError> {
        self.cpu.bus().limit = until;
        loop {
            self.settle()?;
            if self.cpu.bus().work.now >= until {
                return Ok(());
            }
            if self.waits(until) {
                continue;
            }
            let masks = self.cpu.masks();
            let next = self.cpu.bus().nvic.next(masks);
            if let Some(exception) = next {
                self.enter(exception)?;
                continue;
            }
            match self.cpu.run() {
                Stop::Attention => {}
                Stop::Sleep { event } => self.sleep(event, until)?,
                Stop::ExceptionReturn(value) => self.leave(value)?,
                Stop::SupervisorCall => self.cpu.bus().nvic.pend(SV_CALL),
                Stop::Memory { address, write } => {
                    let access = if write {
                        "a store to"
                    } else {
                        "a load or fetch from"
                    };
                    // PRECISERR with BFARVALID.
                    self.fault(0x8200, address, format!("{access} {}", map::name(address)))?;
                }
                // UNDEFINSTR.
                Stop::Undefined => self.fault(1 << 16, 0, "an undefined instruction".to_owned())?,
                Stop::Breakpoint => {
                    self.fault(0, 0, "a breakpoint without a debugger".to_owned())?
                }
            }
        }
    }

    /// Handles due events of the peripherals, reset and failure.
    fn settle(&mut self) -> Result<(), EmulationError> {
        let (failure, changed, bitten, reset) = self.cpu.with_memory(|chip, memory| {
            chip.settle(memory);
            (
                chip.failure.clone(),
                core::mem::take(&mut chip.changed),
                chip.bitten,
                chip.nvic.reset_requested,
            )
        });
        if let Some(error) = failure {
            let at = self.cpu.bus().block;
            return Err(EmulationError::Chip {
                function: self.name(at),
                error,
            });
        }
        for (address, size) in changed {
            self.cpu.forget_code(address, size);
        }
        if let Some(cause) = bitten {
            self.reset(cause);
        } else if reset {
            self.reset(Cause::Software);
        }
        Ok(())
    }

    /// Returns true if the processor is held up; then time has advanced to the next event.
    fn waits(&mut self, until: Instant) -> bool {
        let mut chip = self.cpu.bus();
        let held = if self.locked { NEVER } else { chip.held_until };
        if held <= chip.work.now {
            return false;
        }
        let next = chip.next_event().min(held).min(until);
        chip.skip_to(next);
        true
    }

    /// Sleeps until an interrupt, or an event, or the end of the run.
    fn sleep(&mut self, for_event: bool, until: Instant) -> Result<(), EmulationError> {
        let resets = self.resets.len();
        loop {
            self.settle()?;
            if self.resets.len() > resets {
                return Ok(());
            }
            let masks = self.cpu.masks();
            let mut chip = self.cpu.bus();
            let awake = if for_event {
                chip.event
                    || chip.nvic.next(masks).is_some()
                    || chip.nvic.pending_wakes() && chip.nvic.has_pending()
            } else {
                chip.nvic.wakes(masks)
            };
            if awake {
                chip.event &= !for_event;
                return Ok(());
            }
            if chip.work.now >= until {
                drop(chip);
                // Still asleep: the instruction is repeated.
                let pc = self.cpu.get(Register::Pc);
                self.cpu.set(Register::Pc, pc - 2);
                self.cpu.bus().uncount_sleep();
                return Ok(());
            }
            let next = chip.next_event().min(until);
            chip.skip_to(next);
        }
    }
}
