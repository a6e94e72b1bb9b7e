//! COMP3 and COMP4: over-current protection in hardware. COMP3 compares the current sense with a threshold above its
//! middle, COMP4 with one below. Either acts on TIM1's second break input without the processor, 0.75 µs later (its filter).
//! The comparator itself acts about 0.1 µs after the current gets there (DS12288, comparator: t_D 17 ns typical; the amplifier
//! before it takes 1 µs and more).
//!
//! The two channels of DAC3 give the thresholds (RM0440, COMP, "inverting input assignment": DAC3_CH1 to COMP3,
//! DAC3_CH2 to COMP4). DAC and converter have one reference, so a threshold is a code of the converter.

use embassy_stm32::pac::comp::vals::{Hysteresis, Inm, Polarity};
use embassy_stm32::pac::dac::vals::Mode;
use embassy_stm32::pac::{COMP3, COMP4, DAC3, RCC};

use super::clock::CORE_HZ;

/// Start-up of DAC and comparator in sequence, µs (DS12288: t_WAKEUP of the DAC without buffer at most 5, t_START of
/// the comparator at most 5).
const START_US: u32 = 20;
/// Value of DAC_MCR.HFSEL for an AHB clock above 160 MHz.
const ABOVE_160_MHZ: u8 = 2;

/// Starts both with thresholds, lower and upper, as codes of the converter. The clock of SYSCFG, which the comparators
/// use, must be on.
pub(crate) fn start(thresholds: [u16; 2]) {
    RCC.ahb2enr().modify(|w| w.set_dac3en(true));
    DAC3.mcr().write(|w| {
        w.set_hfsel(ABOVE_160_MHZ);
        w.set_mode(0, Mode::NORMAL_INT_BUFDIS);
        w.set_mode(1, Mode::NORMAL_INT_BUFDIS);
    });
    set_thresholds(thresholds);
    DAC3.cr().write(|w| {
        w.set_en(0, true);
        w.set_en(1, true);
    });
    // PC1 is COMP3's second input, PB0 is COMP4's first. COMP4 is high below its threshold.
    for (comparator, second, polarity) in [
        (COMP3, true, Polarity::NOT_INVERTED),
        (COMP4, false, Polarity::INVERTED),
    ] {
        comparator.csr().write(|w| {
            w.set_inpsel(second);
            w.set_inmsel(Inm::DACA);
            w.set_polarity(polarity);
            w.set_hyst(Hysteresis::HYST10M);
            w.set_en(true);
        });
    }
    cortex_m::asm::delay(START_US * (CORE_HZ / 1_000_000));
}

/// Sets the thresholds, lower and upper.
pub(crate) fn set_thresholds([lower, upper]: [u16; 2]) {
    DAC3.dhr12r(0).write(|w| w.set_dhr(upper));
    DAC3.dhr12r(1).write(|w| w.set_dhr(lower));
}
