//! Clocks: 170 MHz from the internal oscillator, and the priorities that go with them.

use embassy_stm32::Config;
use embassy_stm32::interrupt::Priority;
use embassy_stm32::rcc::{
    APBPrescaler, LsConfig, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux,
};

/// Core, buses and timers, Hz: 16 MHz / 4 · 85 / 2.
pub(crate) const CORE_HZ: u32 = 170_000_000;

/// The control tick comes before everything; whatever it interrupts waits.
pub(crate) const TICK_PRIORITY: Priority = Priority::P0;
/// Serial line, its DMA, and the tasks' clock.
pub(crate) const LINK_PRIORITY: Priority = Priority::P8;

/// What the chip's start is told.
pub(crate) fn config() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hsi = true;
    rcc.pll = Some(Pll {
        source: PllSource::HSI,
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    rcc.sys = Sysclk::PLL1_R;
    // Range 1 boost mode, needed above 150 MHz (RM0440 section 6.1.5).
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
