//! The processor behind one trait, so that the engine can be replaced.

use crate::time::Instant;

/// Registers that exceptions need. Stack pointer: the main stack alone, as embassy uses it.
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
    /// Bit 0 masks all but the faults.
    Primask,
    /// Masks priorities from its value on.
    Basepri,
    /// Bit 0 masks all but NMI.
    Faultmask,
    /// nPRIV, SPSEL, FPCA.
    Control,
    /// Floating-point status and control.
    Fpscr,
    /// S0 to S31.
    Single(u8),
}

/// Why the processor stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The bus wanted the processor to stop: an event is due, or an exception is to be taken.
    Attention,
    /// WFI or WFE, already past it.
    Sleep {
        /// WFE, which an event wakes as well.
        event: bool,
    },
    /// A branch to this EXC_RETURN value.
    ExceptionReturn(u32),
    /// SVC, already past it.
    SupervisorCall,
    /// An access to memory that is not there, or may not be written.
    Memory {
        /// Address.
        address: u32,
        /// A store, not a load or fetch.
        write: bool,
    },
    /// An instruction that the processor does not have.
    Undefined,
    /// BKPT.
    Breakpoint,
}

/// What a block of instructions costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Block {
    /// First instruction.
    pub address: u32,
    /// Bytes.
    pub size: u16,
    /// Instructions, exact. One that is skipped in an IT block counts: it is issued.
    pub instructions: u16,
    /// Cycles with everything in the instruction cache and the closing branch not taken, estimated.
    pub cycles: u16,
    /// Has a floating-point instruction.
    pub float: bool,
    /// Has SEV.
    pub event: bool,
}

/// What the processor sees beside its code and RAM.
pub trait Bus {
    /// A block is about to run. False: stop before it.
    fn block(&mut self, block: &Block, masks: &dyn Fn() -> Masks) -> bool;
    /// Load from a peripheral.
    fn read(&mut self, memory: &mut dyn Memory, address: u32, size: u32) -> u32;
    /// Store to a peripheral.
    fn write(&mut self, memory: &mut dyn Memory, address: u32, size: u32, value: u32);
    /// Store to the flash memory.
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
    /// Reads; false where there is no memory.
    fn load(&mut self, address: u32, into: &mut [u8]) -> bool;
    /// Writes, flash included; false where there is no memory.
    fn store(&mut self, address: u32, bytes: &[u8]) -> bool;
}

/// A Cortex-M4F without its interrupt controller.
pub trait Cpu<B: Bus>: Memory {
    /// The bus.
    fn bus(&mut self) -> std::cell::RefMut<'_, B>;
    /// A register.
    fn get(&self, register: Register) -> u32;
    /// Sets a register.
    fn set(&mut self, register: Register, value: u32);
    /// Runs until something stops it.
    fn run(&mut self) -> Stop;
    /// Has the bus act on memory from outside a run.
    fn with_memory<T>(&mut self, act: impl FnOnce(&mut B, &mut dyn Memory) -> T) -> T;
    /// So many bytes from an address on have changed: whatever was derived from code there is forgotten.
    fn forget_code(&mut self, address: u32, size: u32);
    /// The mask registers.
    fn masks(&self) -> Masks {
        Masks {
            primask: self.get(Register::Primask) & 1 != 0,
            faultmask: self.get(Register::Faultmask) & 1 != 0,
            basepri: self.get(Register::Basepri) as u8,
        }
    }
}

/// Work done, as the bus counts it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Time.
    pub now: Instant,
    /// Instructions, exact.
    pub instructions: u64,
    /// Cycles, estimated, without sleep.
    pub cycles: u64,
    /// Of these, lost to refills of the pipeline after branches.
    pub refills: u64,
    /// Of these, lost to waits for code from the flash memory.
    pub fetches: u64,
    /// Of these, lost on the way to peripherals.
    pub bridge: u64,
}
