//! The state of a running image.

use super::error::EmulationError;
use crate::board::Board;
use crate::chip::Chip;
use crate::cpu::Cpu;
use crate::image::Image;
use crate::peripheral::rcc::Cause;
use crate::time::{self, Instant};

/// Cost of an exception's handler, without handlers that preempted it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Number of runs.
    pub count: u64,
    /// Instructions in all.
    pub instructions: u64,
    /// Most instructions in one run.
    pub worst_instructions: u64,
    /// Cycles in all, estimated, with entry and return.
    pub cycles: u64,
    /// Most cycles in one run.
    pub worst_cycles: u64,
}

/// An exception whose handler runs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Running {
    pub(super) exception: u16,
    pub(super) instructions: u64,
    pub(super) cycles: u64,
    /// Part of handlers that preempted it.
    pub(super) nested_instructions: u64,
    pub(super) nested_cycles: u64,
}

/// Bits of a byte in memory that are cleared whenever an exception begins.
#[derive(Clone, Copy, Debug)]
pub struct Silenced {
    /// Number of the exception.
    pub exception: u16,
    /// The byte.
    pub address: u32,
    /// Its bits.
    pub bits: u8,
}

/// A running image.
pub struct Emulation<C> {
    pub(super) cpu: C,
    pub(super) image: Image,
    pub(super) running: Vec<Running>,
    pub(super) costs: [Cost; 128],
    pub(super) locked: bool,
    /// Resets so far, in order, with their times.
    pub resets: Vec<(Instant, Cause)>,
    /// Faults so far: program counter and what happened.
    pub faults: Vec<(u32, String)>,
    /// Bits cleared whenever an exception begins, as if the program that sets them had stopped.
    pub silenced: Option<Silenced>,
    /// True if faults run the image's HardFault handler instead of ending the run.
    pub faults_expected: bool,
    pub(super) failure: Option<EmulationError>,
}

impl<C: Cpu<Chip>> Emulation<C> {
    /// Returns a word of memory; 0 if there is none.
    pub fn word(&mut self, address: u32) -> u32 {
        let mut bytes = [0; 4];
        self.cpu.load(address, &mut bytes);
        u32::from_le_bytes(bytes)
    }

    /// Returns the processor.
    pub fn cpu(&mut self) -> &mut C {
        &mut self.cpu
    }

    /// Returns the image.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Gives access to the chip. The processor stops at the next block to see the changes.
    pub fn with_chip<T>(&mut self, act: impl FnOnce(&mut Chip) -> T) -> T {
        let mut chip = self.cpu.bus();
        let result = act(&mut chip);
        chip.see_board();
        chip.interrupt_run();
        result
    }

    /// Gives access to the board.
    pub fn with_board<T>(&mut self, act: impl FnOnce(&mut Board) -> T) -> T {
        self.with_chip(|chip| act(&mut chip.board))
    }

    /// Returns the time since power on, s.
    pub fn seconds(&mut self) -> f64 {
        time::to_seconds(self.cpu.bus().work.now)
    }

    /// Returns the cost of an exception's handler so far.
    pub fn cost(&self, exception: u16) -> Cost {
        self.costs
            .get(usize::from(exception))
            .copied()
            .unwrap_or_default()
    }

    /// Resets the costs.
    pub fn clear_costs(&mut self) {
        self.costs = [Cost::default(); 128];
    }

    /// Returns the error that ended the run for good.
    pub fn failure(&self) -> Option<&EmulationError> {
        self.failure.as_ref()
    }

    /// Returns the name of the function at an address.
    pub(super) fn name(&self, address: u32) -> String {
        self.image
            .function_at(address)
            .map_or_else(|| "unknown code".to_owned(), |f| f.name.clone())
    }
}
