//! The clock of 170 MHz and the cycle counter, by the registers of the reference manual (RM0440 rev 8).
#![allow(unsafe_code)]

use cortex_m::peripheral::{DCB, DWT, Peripherals};

const RCC: u32 = 0x4002_1000;
const RCC_CR: u32 = RCC;
const RCC_CFGR: u32 = RCC + 0x08;
const RCC_PLLCFGR: u32 = RCC + 0x0C;
const RCC_APB1ENR1: u32 = RCC + 0x58;
const PWR_CR5: u32 = 0x4000_7080;
const FLASH_ACR: u32 = 0x4002_2000;

/// Reads a register, sets the bits of `mask` to `value`, and writes it back.
fn set(address: u32, mask: u32, value: u32) {
    let register = address as *mut u32;
    // SAFETY: the addresses above are registers of this chip, and nothing else runs.
    unsafe {
        let before = register.read_volatile();
        register.write_volatile(before & !mask | value);
    }
}

/// Waits until the bits of `mask` have the value.
fn wait(address: u32, mask: u32, value: u32) {
    let register = address as *const u32;
    // SAFETY: as in `set`.
    while unsafe { register.read_volatile() } & mask != value {}
}

/// The processor's cycle counter.
pub(crate) struct Cycles(DWT);

impl Cycles {
    /// Returns the count.
    pub(crate) fn now(&self) -> u32 {
        self.0.cyccnt.read()
    }
}

/// Sets the system clock to 170 MHz from the internal oscillator of 16 MHz, and starts the cycle counter.
pub(crate) fn start() -> Cycles {
    // Power control on; boost range (R1MODE = 0) for more than 150 MHz.
    set(RCC_APB1ENR1, 1 << 28, 1 << 28);
    wait(RCC_APB1ENR1, 1 << 28, 1 << 28);
    set(PWR_CR5, 1 << 8, 0);
    // Four wait states, prefetch, both caches.
    set(FLASH_ACR, 0xF | 7 << 8, 4 | 7 << 8);
    wait(FLASH_ACR, 0xF, 4);
    // 16 MHz / 4 · 85 / 2.
    set(RCC_PLLCFGR, u32::MAX, 2 | (4 - 1) << 4 | 85 << 8 | 1 << 24);
    set(RCC_CR, 1 << 24, 1 << 24);
    wait(RCC_CR, 1 << 25, 1 << 25);
    // Half the speed for a microsecond between the two (section 6.1.5).
    set(RCC_CFGR, 0xF << 4 | 3, 8 << 4 | 3);
    wait(RCC_CFGR, 3 << 2, 3 << 2);
    cortex_m::asm::delay(170);
    set(RCC_CFGR, 0xF << 4, 0);
    // SAFETY: nothing else uses the core's peripherals.
    let mut core = unsafe { Peripherals::steal() };
    DCB::enable_trace(&mut core.DCB);
    core.DWT.enable_cycle_counter();
    Cycles(core.DWT)
}
