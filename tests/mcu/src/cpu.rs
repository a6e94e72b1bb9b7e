//! The processor behind a trait, so that the engine can be replaced.

use crate::time::Instant;

/// Registers that exceptions need. Stack pointer: only the main stack, as embassy uses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// R0 to R12.
    General(u8),
    /// Main stack pointer.
    Sp,
    /// Link register.
    Lr,
    /// Program counter; writing it clears the Thumb bit.
    Pc,
    /// Flags, IT state and exception number.
    Xpsr,
    /// Bit 0 masks all exceptions except faults.
    Primask,
    /// Masks priorities from its value on.
    Basepri,
    /// Bit 0 masks all exceptions except NMI.
    Faultmask,
    /// nPRIV, SPSEL, FPCA.
    Control,
    /// Floating-point status and control.
    Fpscr,
    /// S0 to S31.
    Single(u8),
}

/// Reason why the processor stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The bus stopped the processor: an event is due, or an exception must be taken.
    Attention,
    /// WFI or WFE, already passed.
    Sleep {
        /// True for WFE, which an event also ends.
        event: bool,
    },
    /// A branch to this EXC_RETURN value.
    ExceptionReturn(u32),
    /// SVC, already passed.
    SupervisorCall,
    /// An access to memory that does not exist or is read-only.
    Memory {
        /// Address.
        address: u32,
        /// True for a store, false for a load or fetch.
        write: bool,
    },
    /// An instruction that the processor does not have.
    Undefined,
    /// BKPT.
    Breakpoint,
}

/// Cost of a block of instructions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Block {
    /// First instruction.
    pub address: u32,
    /// Bytes.
    pub size: u16,
    /// Instructions, exact. A skipped instruction of an IT block counts, because it is issued.
    pub instructions: u16,
    /// Estimated cycles with all code in the instruction cache and the closing branch not taken.
    pub cycles: u16,
    /// Has a floating-point instruction.
    pub float: bool,
    /// Has SEV.
    pub event: bool,
}

/// The processor's interface to everything except code and RAM.
pub trait Bus {
    /// Called before a block runs. Returns false to stop before it.
    fn block(&mut self, block: &Block, masks: &dyn Fn() -> Masks) -> bool;
    /// Loads from a peripheral.
    fn read(&mut self, memory: &mut dyn Memory, address: u32, size: u32) -> u32;
    /// Stores to a peripheral.
    fn write(&mut self, memory: &mut dyn Memory, address: u32, size: u32, value: u32);
    /// Stores to the flash memory.
    fn flash_write(&mut self, address: u32, size: u32, value: u32);
}

/// The mask registers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Masks {
    /// PRIMASK.
    pub primask: bool,
    /// FAULTMASK.
    pub faultmask: bool,
    /// BASEPRI.
    pub basepri: u8,
}

/// Code and RAM as the other bus masters see them.
pub trait Memory {
    /// Reads; returns false if there is no memory.
    fn load(&mut self, address: u32, into: &mut [u8]) -> bool;
    /// Writes, also to flash; returns false if there is no memory.
    fn store(&mut self, address: u32, bytes: &[u8]) -> bool;
}

/// A Cortex-M4F without its interrupt controller.
pub trait Cpu<B: Bus>: Memory {
    /// Returns the bus.
    fn bus(&mut self) -> std::cell::RefMut<'_, B>;
    /// Returns a register.
    fn get(&self, register: Register) -> u32;
    /// Sets a register.
    fn set(&mut self, register: Register, value: u32);
    /// Runs until it must stop.
    fn run(&mut self) -> Stop;
    /// Lets the bus access memory outside a run.
    fn with_memory<T>(&mut self, act: impl FnOnce(&mut B, &mut dyn Memory) -> T) -> T;
    /// Discards everything derived from code in `size` changed bytes from `address` on.
    fn forget_code(&mut self, address: u32, size: u32);
    /// Returns the mask registers.
    fn masks(&self) -> Masks {
        Masks {
            primask: self.get(Register::Primask) & 1 != 0,
            faultmask: self.get(Register::Faultmask) & 1 != 0,
            basepri: self.get(Register::Basepri) as u8,
        }
    }
}

/// Work done, counted by the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Time.
    pub now: Instant,
    /// Instructions, exact.
    pub instructions: u64,
    /// Cycles, estimated, without sleep.
    pub cycles: u64,
    /// Part of the cycles lost to refills of the pipeline after branches.
    pub refills: u64,
    /// Part of the cycles lost to waits for code from the flash memory.
    pub fetches: u64,
    /// Part of the cycles lost on the way to peripherals.
    pub bridge: u64,
}
