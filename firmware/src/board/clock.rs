//! Clocks and priorities: 170 MHz from the board's crystal or, if it does not start, from the chip's own oscillator.

use embassy_stm32::Config;
use embassy_stm32::interrupt::Priority;
use embassy_stm32::pac::{PWR, RCC};
use embassy_stm32::rcc::{
    APBPrescaler, Hse, HseMode, LsConfig, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux,
};
use embassy_stm32::time::Hertz;

/// Core, buses and timers, Hz: 24 MHz / 6 · 85 / 2, or 16 MHz / 4 · 85 / 2.
pub(crate) const CORE_HZ: u32 = 170_000_000;

/// Priority of the control tick, above everything else.
pub(crate) const TICK_PRIORITY: Priority = Priority::P0;
/// Serial line, its DMA, and the tasks' clock.
pub(crate) const LINK_PRIORITY: Priority = Priority::P8;

/// The crystal of a NUCLEO-G474RE (UM2505, X3).
const CRYSTAL: Hertz = Hertz(24_000_000);
/// Longest wait for the crystal: several times its start-up time of about 2 ms (DS12288, t_SU(HSE)).
const CRYSTAL_WAIT_MS: u32 = 20;
/// Frequency after reset, kHz.
const RESET_KHZ: u32 = 16_000;

/// Returns true if the crystal starts. A rig with a clock error of 1 % identifies inertia with an error of 2 %.
pub(crate) fn start_crystal() -> bool {
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

/// Raises the core voltage for clocks above 150 MHz (range 1 boost mode, RM0440 section 6.1.5): clears PWR_CR5.R1MODE,
/// bit 8. The register description behind [`embassy_stm32::init`] (stm32-metapac 21.0.0) has it in bit 0, so a request
/// there has no effect.
pub(crate) fn boost() {
    RCC.apb1enr1().modify(|w| w.set_pwren(true));
    PWR.cr5().modify(|w| w.0 &= !(1 << 8));
}

/// Watches a crystal that started. If it stops, the chip continues on its own oscillator, a break switches the outputs
/// off, and the non-maskable interrupt restarts the program (RM0440, RCC, "Clock security system").
pub(crate) fn enable_clock_security(crystal: bool) {
    if crystal {
        RCC.cr().modify(|w| w.set_csson(true));
    }
}

/// Priority of the tasks that must not wait for other tasks.
pub(crate) const TASK_PRIORITY: Priority = Priority::P10;

/// Returns the configuration for the start of the chip.
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
