//! The whole emulated board: the processor's exceptions, sleep and reset, and the run.

mod exceptions;

use thiserror::Error;

use crate::board::Board;
use crate::chip::{Chip, ChipError};
use crate::cpu::{Cpu, Register, Stop};
use crate::image::Image;
use crate::map;
use crate::nvic::SV_CALL;
use crate::peripheral::rcc::Cause;
use crate::time::{self, Instant, NEVER};

/// Exception entry and return on a Cortex-M4 without wait states (ARM DDI 0439B, section 3.9.1).
const ENTRY: u64 = 12;
const RETURN: u64 = 10;
/// Content of untouched RAM, to find the deepest use of the stack.
const PAINT: u8 = 0xA5;
/// Stack paint of `cortex-m-rt` (its feature `paint-stack`), which the image itself reads.
const PAINTED: u8 = 0xCC;

/// Reason why a run ended early.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum EmulationError {
    /// An access that is not modelled, or a misuse of the chip.
    #[error("in {function}: {error}")]
    Chip {
        /// Running function.
        function: String,
        /// The error.
        error: ChipError,
    },
    /// The processor faulted, and no fault was expected.
    #[error("{what} at {pc:#010x} in {function}: the processor goes to HardFault")]
    Fault {
        /// The fault.
        what: String,
        /// Program counter.
        pc: u32,
        /// Function.
        function: String,
    },
    /// An unmodelled behaviour of the processor.
    #[error("{0}")]
    Processor(String),
}

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

#[derive(Clone, Copy, Debug)]
struct Running {
    exception: u16,
    instructions: u64,
    cycles: u64,
    /// Part of handlers that preempted it.
    nested_instructions: u64,
    nested_cycles: u64,
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
    cpu: C,
    image: Image,
    running: Vec<Running>,
    costs: [Cost; 128],
    locked: bool,
    /// Resets so far, in order, with their times.
    pub resets: Vec<(Instant, Cause)>,
    /// Faults so far: program counter and what happened.
    pub faults: Vec<(u32, String)>,
    /// Bits cleared whenever an exception begins, as if the program that sets them had stopped.
    pub silenced: Option<Silenced>,
    /// True if faults run the image's HardFault handler instead of ending the run.
    pub faults_expected: bool,
    failure: Option<EmulationError>,
}

impl<C: Cpu<Chip>> Emulation<C> {
    /// Loads an image into a processor whose chip is at power on.
    pub fn new(cpu: C, image: Image) -> Self {
        let mut emulation = Self {
            cpu,
            image,
            running: Vec::new(),
            costs: [Cost::default(); 128],
            locked: false,
            resets: Vec::new(),
            faults: Vec::new(),
            silenced: None,
            faults_expected: false,
            failure: None,
        };
        let flash = emulation.image.flash.clone();
        emulation.cpu.store(map::FLASH.start, &flash);
        let system = factory_data();
        emulation.cpu.store(map::SYSTEM.start, &system);
        let ram = vec![PAINT; (map::RAM.end - map::RAM.start) as usize];
        emulation.cpu.store(map::RAM.start, &ram);
        emulation.start();
        emulation
    }

    fn start(&mut self) {
        self.running.clear();
        self.locked = false;
        let vectors = map::FLASH.start;
        let (sp, pc) = (self.word(vectors), self.word(vectors + 4));
        for n in 0..13 {
            self.cpu.set(Register::General(n), 0);
        }
        self.cpu.set(Register::Control, 0);
        self.cpu.set(Register::Primask, 0);
        self.cpu.set(Register::Basepri, 0);
        self.cpu.set(Register::Faultmask, 0);
        self.cpu.set(Register::Xpsr, 0);
        self.cpu.set(Register::Sp, sp);
        self.cpu.set(Register::Lr, 0xFFFF_FFFF);
        self.cpu.set(Register::Pc, pc);
        // The boot loader's choice of memory puts the vectors at the start of the flash memory.
        let mut chip = self.cpu.bus();
        let now = chip.work.now;
        let period = time::UNITS_PER_SECOND / 16_000_000;
        // VTOR is 0 after reset, where the flash memory has an alias. The emulation uses its own address.
        let _ = chip.nvic.write(now, period, 0xD08, 4, vectors);
    }

    /// Resets the chip. Flash memory and RAM keep their contents.
    pub fn reset(&mut self, cause: Cause) {
        let now = {
            let mut chip = self.cpu.bus();
            chip.reset(cause);
            chip.work.now
        };
        self.resets.push((now, cause));
        self.start();
    }

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

    /// Returns the lowest allowed end of the stack, and its beginning.
    fn stack_range(&mut self) -> (u32, u32) {
        let top = self.word(map::FLASH.start);
        let bottom = ["__euninit", "__ebss", "_stack_end"]
            .iter()
            .filter_map(|name| self.image.symbol(name))
            .map(|(address, _)| address)
            .filter(|address| *address < top)
            .max()
            .unwrap_or(map::RAM.start);
        (bottom, top)
    }

    /// Returns the bytes of the stack used since the start or [`forget_stack`](Self::forget_stack), and the bytes
    /// available before the statics.
    pub fn stack(&mut self) -> (u32, u32) {
        let (bottom, top) = self.stack_range();
        let mut bytes = vec![0; (top - bottom) as usize];
        self.cpu.load(bottom, &mut bytes);
        let painted = |byte: &&u8| matches!(**byte, PAINT | PAINTED);
        let untouched = bytes.iter().take_while(painted).count();
        (top - bottom - untouched as u32, top - bottom)
    }

    /// Forgets the deepest use of the stack: paints the stack below its present end again.
    pub fn forget_stack(&mut self) {
        let (bottom, _) = self.stack_range();
        let now = self.cpu.get(Register::Sp);
        self.cpu
            .store(bottom, &vec![PAINTED; now.saturating_sub(bottom) as usize]);
    }

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
        if bitten {
            self.reset(Cause::Watchdog);
        } else if reset {
            self.reset(Cause::Software);
        }
        Ok(())
    }

    fn name(&self, address: u32) -> String {
        self.image
            .function_at(address)
            .map_or_else(|| "unknown code".to_owned(), |f| f.name.clone())
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

/// Returns the system memory with factory data: unique identifier, flash size, calibration values (RM0440 section 48,
/// DS12288 tables 5 and 6).
fn factory_data() -> Vec<u8> {
    let mut bytes = vec![0xFF; (map::SYSTEM.end - map::SYSTEM.start) as usize];
    let mut put = |address: u32, value: &[u8]| {
        let from = (address - map::SYSTEM.start) as usize;
        if let Some(place) = bytes.get_mut(from..from + value.len()) {
            place.copy_from_slice(value);
        }
    };
    put(0x1FFF_7590, b"RIG-MCU-0001");
    put(0x1FFF_75E0, &512_u16.to_le_bytes());
    put(0x1FFF_75A8, &1034_u16.to_le_bytes());
    // VREFINT of 1.2085 V at 3.0 V.
    put(0x1FFF_75AA, &1650_u16.to_le_bytes());
    put(0x1FFF_75CA, &1378_u16.to_le_bytes());
    bytes
}
