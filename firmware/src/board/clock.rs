//! Clocks: 170 MHz from the board's crystal or, where it does not start, from the chip's own oscillator; and the
//! priorities that go with them.

use embassy_stm32::Config;
use embassy_stm32::interrupt::Priority;
use embassy_stm32::pac::{PWR, RCC};
use embassy_stm32::rcc::{
    APBPrescaler, Hse, HseMode, LsConfig, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux,
};
use embassy_stm32::time::Hertz;

/// Core, buses and timers, Hz: 24 MHz / 6 · 85 / 2, or 16 MHz / 4 · 85 / 2.
pub(crate) const CORE_HZ: u32 = 170_000_000;

/// The control tick comes before everything; whatever it interrupts waits.
pub(crate) const TICK_PRIORITY: Priority = Priority::P0;
/// Serial line, its DMA, and the tasks' clock.
pub(crate) const LINK_PRIORITY: Priority = Priority::P8;

/// The crystal of a NUCLEO-G474RE (UM2505, X3).
const CRYSTAL: Hertz = Hertz(24_000_000);
/// Longest wait for the crystal: several times its start-up of some 2 ms (DS12288, t_SU(HSE)).
const CRYSTAL_WAIT_MS: u32 = 20;
/// Frequency out of reset, kHz.
const RESET_KHZ: u32 = 16_000;

/// Whether the crystal starts. A rig that counts time 1 % wrong identifies inertia 2 % wrong.
pub(crate) fn crystal() -> bool {
    RCC.cr().modify(|w| w.set_hseon(true));
    for _ in 0..10 * CRYSTAL_WAIT_MS {
        if RCC.cr().read().hserdy() {
            return true;
        }
        cortex_m::asm::delay(RESET_KHZ / 10);
    }
    RCC.cr().modify(|w| w.set_hseon(false));
    false
}

/// Raises the core's voltage for clocks above 150 MHz (range 1 boost mode, RM0440 section 6.1.5): PWR_CR5.R1MODE,
/// bit 8, cleared. The register description behind [`embassy_stm32::init`] (stm32-metapac 21.0.0) has it in bit 0,
/// so that what is asked for there never comes.
pub(crate) fn boost() {
    RCC.apb1enr1().modify(|w| w.set_pwren(true));
    PWR.cr5().modify(|w| w.0 &= !(1 << 8));
}

/// Watches a crystal that started: should it stop, the chip goes on by its own oscillator, a break switches the outputs
/// off, and the non-maskable interrupt starts the program anew (RM0440, RCC, "Clock security system").
pub(crate) fn watch(crystal: bool) {
    if crystal {
        RCC.cr().modify(|w| w.set_csson(true));
    }
}

/// The tasks that may not wait for the others.
pub(crate) const TASK_PRIORITY: Priority = Priority::P10;

/// What the chip's start is told.
pub(crate) fn config(crystal: bool) -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hsi = true;
    rcc.hse = crystal.then_some(Hse {
        freq: CRYSTAL,
        mode: HseMode::Oscillator,
    });
    rcc.hsi48 = None;
    rcc.pll = Some(Pll {
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
    rcc.sys = Sysclk::PLL1_R;
    // Range 1 boost mode, needed above 150 MHz (RM0440, PWR, "Dynamic voltage scaling management").
    rcc.boost = true;
    rcc.apb1_pre = APBPrescaler::DIV1;
    rcc.apb2_pre = APBPrescaler::DIV1;
    rcc.mux.adc12sel = mux::Adcsel::SYS;
    rcc.mux.lpuart1sel = mux::Uartsel::PCLK1;
    // The watchdog starts its own oscillator.
    rcc.ls = LsConfig::off();
    config.bdma_interrupt_priority = LINK_PRIORITY;
    config
}
