//! The processor by unicorn (QEMU's translator as a library).
//!
//! What unicorn lacks is done elsewhere: exceptions in [`crate::nvic`] and [`crate::emulation`], time and
//! peripherals behind [`Bus`]. What is particular here:
//! * Blocks, not instructions, are counted: the hook runs before each translated block, and the block is read
//!   once for its instructions ([`crate::cost`]). Stopping in that hook stops before the block.
//! * The translator takes WFI and WFE for invalid instructions; the program counter is past them by then.
//! * Writing the exception number alone leaves the translator with the flags of thread mode; writing the
//!   condition flags after it has them made anew.
//! * Callbacks of peripherals read no register: that would leave a stale IT state behind.

use std::cell::{Cell, RefCell, RefMut};
use std::rc::Rc;

use unicorn_engine::{
    Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM, Unicorn, uc_error,
};

use crate::cost;
use crate::cpu::{Block, Bus, Cpu, Masks, Memory, Register, Stop};
use crate::map;

/// The engine cannot be set up, or does not support a request.
#[derive(Debug, thiserror::Error)]
#[error("the processor's engine fails ({0:?}): is unicorn 2.1.5 what was built?")]
pub struct EngineError(uc_error);

impl From<uc_error> for EngineError {
    fn from(error: uc_error) -> Self {
        Self(error)
    }
}

/// An address without code: the engine runs "until" it.
const NOWHERE: u64 = 0x3000_0000;

const HALVES_OF_FLASH: usize = (map::FLASH.end - map::FLASH.start) as usize / 2;

/// Returns the place of a block's costs: blocks in flash first, then in the CCM SRAM, where code is written once before
/// it runs. A block of another size is read again.
fn place(address: u32) -> Option<usize> {
    let within = |region: core::ops::Range<u32>| (address - region.start) as usize / 2;
    if map::FLASH.contains(&address) {
        Some(within(map::FLASH))
    } else if map::CCM.contains(&address) {
        Some(HALVES_OF_FLASH + within(map::CCM))
    } else {
        None
    }
}

/// A Cortex-M4F run by unicorn.
pub struct UnicornCpu<B: Bus + 'static> {
    engine: Unicorn<'static, ()>,
    bus: Rc<RefCell<B>>,
    stop: Rc<Cell<Option<Stop>>>,
    blocks: Rc<RefCell<Vec<Block>>>,
}

struct Ram<'e, 'a>(&'e mut Unicorn<'a, ()>);

impl Memory for Ram<'_, '_> {
    fn load(&mut self, address: u32, into: &mut [u8]) -> bool {
        self.0.mem_read(u64::from(address), into).is_ok()
    }
    fn store(&mut self, address: u32, bytes: &[u8]) -> bool {
        self.0.mem_write(u64::from(address), bytes).is_ok()
    }
}

fn number(register: Register) -> i32 {
    let id = match register {
        Register::General(n) => return RegisterARM::R0 as i32 + i32::from(n),
        Register::Single(n) => return RegisterARM::S0 as i32 + i32::from(n),
        Register::Sp => RegisterARM::SP,
        Register::Lr => RegisterARM::LR,
        Register::Pc => RegisterARM::PC,
        Register::Xpsr => RegisterARM::XPSR,
        Register::Primask => RegisterARM::PRIMASK,
        Register::Basepri => RegisterARM::BASEPRI,
        Register::Faultmask => RegisterARM::FAULTMASK,
        Register::Control => RegisterARM::CONTROL,
        Register::Fpscr => RegisterARM::FPSCR,
    };
    id as i32
}

fn mask(engine: &Unicorn<'_, ()>, register: Register) -> u32 {
    engine.reg_read(number(register)).unwrap_or(0) as u32
}

impl<B: Bus + 'static> UnicornCpu<B> {
    /// Returns a processor with the chip's memories, everything else on `bus`.
    ///
    /// # Errors
    /// The error of the engine.
    pub fn new(bus: B) -> Result<Self, EngineError> {
        let mut engine = Unicorn::new(Arch::ARM, Mode::MCLASS)?;
        engine.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)?;
        engine.mem_map(
            map::FLASH.start.into(),
            u64::from(map::FLASH.end - map::FLASH.start),
            Prot::READ | Prot::EXEC,
        )?;
        engine.mem_map(
            map::RAM.start.into(),
            u64::from(map::RAM.end - map::RAM.start),
            Prot::ALL,
        )?;
        // Its alias behind SRAM2 is separate memory here: no image uses both.
        engine.mem_map(
            map::CCM.start.into(),
            u64::from(map::CCM.end - map::CCM.start),
            Prot::ALL,
        )?;
        engine.mem_map(
            map::SYSTEM.start.into(),
            u64::from(map::SYSTEM.end - map::SYSTEM.start),
            Prot::READ,
        )?;
        let mut cpu = Self {
            engine,
            bus: Rc::new(RefCell::new(bus)),
            stop: Rc::default(),
            blocks: Rc::new(RefCell::new(vec![
                Block::default();
                HALVES_OF_FLASH
                    + (map::CCM.end - map::CCM.start)
                        as usize
                        / 2
            ])),
        };
        for region in [map::PERIPHERALS, map::CORE] {
            cpu.map_bus(region)?;
        }
        cpu.hook_blocks()?;
        cpu.hook_faults()?;
        Ok(cpu)
    }

    fn map_bus(&mut self, region: core::ops::Range<u32>) -> Result<(), uc_error> {
        let (reader, writer) = (self.bus.clone(), self.bus.clone());
        let start = region.start;
        self.engine.mmio_map(
            u64::from(start),
            u64::from(region.end - start),
            Some(
                move |engine: &mut Unicorn<'_, ()>, offset: u64, size: usize| {
                    let address = start + offset as u32;
                    let mut bus = reader.borrow_mut();
                    u64::from(bus.read(&mut Ram(engine), address, size as u32))
                },
            ),
            Some(
                move |engine: &mut Unicorn<'_, ()>, offset: u64, size: usize, value: u64| {
                    let address = start + offset as u32;
                    let mut bus = writer.borrow_mut();
                    bus.write(&mut Ram(engine), address, size as u32, value as u32);
                },
            ),
        )
    }

    fn hook_blocks(&mut self) -> Result<(), uc_error> {
        let (bus, stop, blocks) = (self.bus.clone(), self.stop.clone(), self.blocks.clone());
        // An empty range of addresses means all of them.
        self.engine
            .add_block_hook(1, 0, move |engine, address, size| {
                let address = address as u32;
                let mut blocks = blocks.borrow_mut();
                let place = place(address);
                let read = |engine: &Unicorn<'_, ()>| {
                    let mut code = vec![0; size as usize];
                    match engine.mem_read(address.into(), &mut code) {
                        Ok(()) => cost::of_block(address, &code),
                        Err(_) => Block::default(),
                    }
                };
                let block = match place.and_then(|place| blocks.get_mut(place)) {
                    Some(known) => {
                        if u32::from(known.size) != size {
                            *known = read(engine);
                        }
                        *known
                    }
                    None => read(engine),
                };
                let go = {
                    let engine = &*engine;
                    let masks = || Masks {
                        primask: mask(engine, Register::Primask) & 1 != 0,
                        faultmask: mask(engine, Register::Faultmask) & 1 != 0,
                        basepri: mask(engine, Register::Basepri) as u8,
                    };
                    bus.borrow_mut().block(&block, &masks)
                };
                if !go {
                    stop.set(Some(Stop::Attention));
                    // Fails only if no code runs.
                    let _ = engine.emu_stop();
                }
            })?;
        Ok(())
    }

    fn hook_faults(&mut self) -> Result<(), uc_error> {
        let (bus, stop) = (self.bus.clone(), self.stop.clone());
        self.engine.add_mem_hook(
            HookType::MEM_UNMAPPED | HookType::MEM_PROT,
            1,
            0,
            move |_, kind, address, size, value| {
                let address = address as u32;
                if kind == MemType::WRITE_PROT && map::FLASH.contains(&address) {
                    bus.borrow_mut()
                        .flash_write(address, size as u32, value as u32);
                    return true;
                }
                let fetch = matches!(kind, MemType::FETCH_UNMAPPED | MemType::FETCH_PROT);
                stop.set(Some(if fetch && address >= 0xFFFF_FF00 {
                    Stop::ExceptionReturn(address | 1)
                } else {
                    Stop::Memory {
                        address,
                        write: matches!(kind, MemType::WRITE_UNMAPPED | MemType::WRITE_PROT),
                    }
                }));
                false
            },
        )?;
        let stop = self.stop.clone();
        self.engine.add_intr_hook(move |engine, exception| {
            // QEMU's numbers: target/arm/cpu.h.
            stop.set(Some(match exception {
                2 => Stop::SupervisorCall,
                7 => Stop::Breakpoint,
                8 => Stop::ExceptionReturn(mask(engine, Register::Pc) | 1),
                _ => Stop::Undefined,
            }));
            let _ = engine.emu_stop();
        })?;
        let stop = self.stop.clone();
        self.engine.add_insn_invalid_hook(move |engine| {
            let past = mask(engine, Register::Pc);
            let mut code = [0; 2];
            let known = engine.mem_read(u64::from(past.wrapping_sub(2)), &mut code);
            let sleep = match (known, u16::from_le_bytes(code)) {
                (Ok(()), 0xBF20) => Some(Stop::Sleep { event: true }),
                (Ok(()), 0xBF30) => Some(Stop::Sleep { event: false }),
                _ => None,
            };
            stop.set(Some(sleep.unwrap_or(Stop::Undefined)));
            let _ = engine.emu_stop();
            sleep.is_some()
        })?;
        Ok(())
    }
}

impl<B: Bus + 'static> Memory for UnicornCpu<B> {
    fn load(&mut self, address: u32, into: &mut [u8]) -> bool {
        Ram(&mut self.engine).load(address, into)
    }
    fn store(&mut self, address: u32, bytes: &[u8]) -> bool {
        Ram(&mut self.engine).store(address, bytes)
    }
}

impl<B: Bus + 'static> Cpu<B> for UnicornCpu<B> {
    fn bus(&mut self) -> RefMut<'_, B> {
        self.bus.borrow_mut()
    }

    fn get(&self, register: Register) -> u32 {
        mask(&self.engine, register)
    }

    fn set(&mut self, register: Register, value: u32) {
        let value = match register {
            Register::Pc => value | 1,
            // The mode is always Thumb.
            Register::Xpsr => value | 1 << 24,
            _ => value,
        };
        // Fails only for registers that do not exist.
        let _ = self.engine.reg_write(number(register), value.into());
        if register == Register::Xpsr {
            let _ = self
                .engine
                .reg_write(RegisterARM::APSR_NZCV as i32, value.into());
        }
    }

    fn run(&mut self) -> Stop {
        self.stop.set(None);
        let from = u64::from(self.get(Register::Pc) | 1);
        let result = self.engine.emu_start(from, NOWHERE, 0, 0);
        match (self.stop.take(), result) {
            (Some(stop), _) => stop,
            (None, Ok(())) => Stop::Attention,
            (None, Err(_)) => Stop::Undefined,
        }
    }

    fn with_memory<T>(&mut self, act: impl FnOnce(&mut B, &mut dyn Memory) -> T) -> T {
        act(&mut self.bus.borrow_mut(), &mut Ram(&mut self.engine))
    }

    fn forget_code(&mut self, address: u32, size: u32) {
        let Some(from) = place(address) else { return };
        let mut blocks = self.blocks.borrow_mut();
        let ran = blocks
            .get(from..from + size as usize / 2)
            .is_some_and(|part| part.iter().any(|block| block.size != 0));
        if ran {
            blocks.fill(Block::default());
            // Fails only without a translator.
            let _ = self.engine.ctl_flush_tb();
        }
    }
}
