//! Power on and reset.

use super::stack::PAINT;
use super::state::{Cost, Emulation};
use crate::chip::Chip;
use crate::cpu::{Cpu, Register};
use crate::image::Image;
use crate::map;
use crate::peripheral::rcc::Cause;
use crate::time;

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

    /// Sets the processor to its state after reset.
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
