//! Clocks and priorities: 170 MHz from the board's crystal or, if it does not start, from the chip's own oscillator.

use embassy_stm32::interrupt::Priority;
use embassy_stm32::pac::{PWR, RCC};
use embassy_stm32::rcc::{
    self, APBPrescaler, Hse, HseMode, LsConfig, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk,
    mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};

use super::watchdog;

/// Core, buses and timers, Hz: 24 MHz / 6 · 85 / 2, or 16 MHz / 4 · 85 / 2.
pub(crate) const CORE_HZ: u32 = 170_000_000;

/// Priority of the warning that the control tick has stopped: the only one above the tick.
pub(crate) const TICK_WATCH_PRIORITY: Priority = Priority::P0;
/// Priority of the control tick, above everything else.
pub(crate) const TICK_PRIORITY: Priority = Priority::P1;
/// Serial line, its DMA, and the tasks' clock.
pub(crate) const LINK_PRIORITY: Priority = Priority::P8;

/// The crystal of a NUCLEO-G474RE (UM2505, X3).
const CRYSTAL: Hertz = Hertz(24_000_000);
/// Longest wait for the crystal: several times its start-up time of about 2 ms (DS12288, t_SU(HSE)).
const CRYSTAL_WAIT_MS: u32 = 20;
/// Frequency after reset, kHz.
const RESET_KHZ: u32 = 16_000;

/// Returns true if the crystal starts. A rig with a clock error of 1 % identifies inertia with an error of 2 %.
fn start_crystal() -> bool {
    RCC.cr().modify(|w| w.set_hseon(true));
    for _ in 0..10 * CRYSTAL_WAIT_MS {
        if RCC.cr().read().hserdy() {
            return true;
        }
        // The wait ends by its count, which takes longer than its time.
        watchdog::feed();
        cortex_m::asm::delay(RESET_KHZ / 10);
    }
    RCC.cr().modify(|w| w.set_hseon(false));
    false
}

/// PWR_CR5.R1MODE: set in the normal mode of range 1, for clocks up to 150 MHz; clear in its boost mode. The register
/// description behind [`embassy_stm32::init`] (stm32-metapac 21.0.0) has it in bit 0, so a request there has no effect.
const R1MODE: u32 = 1 << 8;

/// Raises the core voltage for clocks above 150 MHz (range 1 boost mode, RM0440 section 6.1.5).
///
/// Call it after [`embassy_stm32::init`], which resets the power control (RCC_APB1RSTR1.PWRRST). RM0440 says of CR5 that
/// only a power-on reset resets it (section 6.4.22); this order does not depend on that.
fn boost() {
    PWR.cr5().modify(|w| w.0 &= !R1MODE);
}

/// Returns true if the core has the voltage of clocks above 150 MHz now.
#[inline(always)]
pub(crate) fn is_boosted() -> bool {
    PWR.cr5().read().0 & R1MODE == 0
}

/// Initialises the chip, then raises core voltage and clock. Returns also true if the crystal runs.
///
/// The first step stays at the 16 MHz of a reset: it resets the power control. If that took back a voltage that was raised
/// before it, 170 MHz would run in the range for 150 MHz.
pub(crate) fn start() -> (Peripherals, bool) {
    let mut plain = Config::default();
    plain.rcc.hsi48 = None;
    plain.rcc.ls = LsConfig::off();
    plain.bdma_interrupt_priority = LINK_PRIORITY;
    let mut peripherals = embassy_stm32::init(plain);
    let crystal = start_crystal();
    boost();
    embassy_stm32::rcc::reinit(tree(crystal), &mut peripherals.RCC);
    enable_clock_security(crystal);
    (peripherals, crystal)
}

/// Watches a crystal that started. If it stops, the chip continues on its own oscillator, a break switches the outputs
/// off, and the non-maskable interrupt restarts the program (RM0440, RCC, "Clock security system").
fn enable_clock_security(crystal: bool) {
    if crystal {
        RCC.cr().modify(|w| w.set_csson(true));
    }
}

/// Priority of the task that receives: below the line's interrupts, which wake it, and above all other tasks.
pub(crate) const RECEIVE_PRIORITY: Priority = Priority::P9;
/// Priority of the tasks that must not wait for other tasks.
pub(crate) const TASK_PRIORITY: Priority = Priority::P10;

/// Returns the clock tree of 170 MHz.
fn tree(crystal: bool) -> rcc::Config {
    let mut tree = rcc::Config::default();
    tree.hsi = true;
    tree.hse = crystal.then_some(Hse {
        freq: CRYSTAL,
        mode: HseMode::Oscillator,
    });
    tree.hsi48 = None;
    tree.pll = Some(Pll {
        source: if crystal {
            PllSource::HSE
        } else {
            PllSource::HSI
        },
        prediv: if crystal {
            PllPreDiv::DIV6
        } else {
            PllPreDiv::DIV4
        },
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    tree.sys = Sysclk::PLL1_R;
    // The steps of the change to range 1 boost mode (RM0440, PWR, "Dynamic voltage scaling management").
    tree.boost = true;
    tree.apb1_pre = APBPrescaler::DIV1;
    tree.apb2_pre = APBPrescaler::DIV1;
    tree.mux.adc12sel = mux::Adcsel::SYS;
    tree.mux.lpuart1sel = mux::Uartsel::PCLK1;
    // The watchdog has started its own oscillator, which no program can stop (RM0440, RCC, "LSI clock").
    tree.ls = LsConfig::off();
    tree
}
