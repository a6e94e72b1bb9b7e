//! ADC1: current, supply and temperature, triggered only by TIM4 in step with the PWM.
//!
//! An injected sequence of three. Each conversion is the mean of four (RM0440, ADC, "Oversampler"), taken within 3.5
//! µs: with 12-bit codes as before, this halves white noise. The current comes first. It is held at 0.62, 1.49, 2.37
//! and 3.24 µs after the trigger, 1.93 µs in the mean. The trigger comes this time, less the delay of bridge and amplifier,
//! before the middle of a braking interval ([`SAMPLING_LEAD`]). Otherwise the current would read low by (R·i + Kₑ·ω)/L times the delay, like a smaller
//! friction.

use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::adc::vals::{Adcaldif, Difsel, Exten, SampleTime};
use embassy_stm32::pac::adccommon::vals::{Ckmode, Presc};
use embassy_stm32::pac::{ADC1, ADC12_COMMON, RCC, VREFINTCAL};
use rig_firmware::nameplate::{RATES, SENSE_DELAY_NS};
use rig_firmware::sample::SAMPLE_HALF_SPAN_NS;
use rig_shared::units::AdcCode;

use super::clock::{CORE_HZ, TICK_PRIORITY};
use super::pins::{AnalogPins, CURRENT_CHANNEL, SUPPLY_CHANNEL, TEMPERATURE_CHANNEL};

/// TIM4_TRGO among the injected triggers of ADC1 (RM0440, table "ADC1/2 - External triggers for injected channels").
const TRIGGER: u8 = 5;
/// Core cycles per converter cycle: 170 MHz / 4 = 42.5 MHz, below the 60 MHz of a single converter (DS12288).
const PRESCALER: u16 = 4;
/// Conversions averaged for one code.
const CONVERSIONS: u16 = 4;
/// Half cycles of the converter: from the trigger to the first sampling, typical (DS12288, t_LATRINJ), for sampling,
/// and for the approximation after it (RM0440, ADC, "Channel-wise programmable sampling time").
const LATENCY: u16 = 2 * 2;
const SAMPLING: u16 = 2 * 24 + 1;
const APPROXIMATION: u16 = 2 * 12 + 1;
/// Core cycles from the trigger to the mean instant at which the current's samples are held, each at the end of its
/// sampling time.
const MEAN_HOLD: u16 =
    (2 * (LATENCY + SAMPLING) + (CONVERSIONS - 1) * (SAMPLING + APPROXIMATION)) * PRESCALER / 4;
/// Core cycles from the mean instant to the first or last of the samples.
const HALF_SPAN: u16 = (CONVERSIONS - 1) * (SAMPLING + APPROXIMATION) * PRESCALER / 4;
const _: () = assert!(HALF_SPAN as u32 * 1000 <= SAMPLE_HALF_SPAN_NS * (CORE_HZ / 1_000_000));
/// Delay of bridge and amplifier, core cycles, in whole converter cycles.
const SENSE_DELAY: u16 =
    (SENSE_DELAY_NS * (CORE_HZ / 1_000_000) / 1000) as u16 / PRESCALER * PRESCALER;
/// Core cycles from the trigger to the middle of a braking interval at the bridge's inputs. The samples are centred on that
/// interval as the amplifier shows it, later by its delay.
pub(crate) const SAMPLING_LEAD: u16 = MEAN_HOLD - SENSE_DELAY;
// A trigger in step with the divided clock is taken without jitter (errata ES0430, 2.7.11), and comes before the interval.
const _: () = assert!(SENSE_DELAY < MEAN_HOLD && SAMPLING_LEAD.is_multiple_of(PRESCALER));
const _: () = assert!((CORE_HZ / RATES.control_hz).is_multiple_of(PRESCALER as u32));
/// Start-up time of the voltage regulator, µs (DS12288, t_ADCVREG_STUP).
const REGULATOR_US: u32 = 20;

/// Channel of the chip's own reference, start-up of its buffer in µs (DS12288, V_REFINT and t_start_vrefint), and
/// number of readings.
const REFERENCE_CHANNEL: u8 = 18;
const REFERENCE_US: u32 = 20;
const REFERENCE_READINGS: u32 = 16;
/// Ratio of the supply during factory measurement to the nominal one (DS12288, "Internal voltage reference calibration
/// values"): 3.0 V over 3.3 V, as whole numbers.
const CALIBRATED_AT: [u32; 2] = [10, 11];

/// The converter.
pub(crate) struct Converter;

/// Codes of one sequence.
pub(crate) struct Codes {
    pub(crate) current: AdcCode,
    pub(crate) supply: AdcCode,
    pub(crate) temperature: AdcCode,
}

impl Converter {
    /// Calibrates the converter and makes it wait for its trigger. The interrupt is not yet enabled. Also returns the
    /// ratio of the converter's reference (the chip's supply) to its nominal 3.3 V.
    pub(crate) fn new(pins: AnalogPins) -> (Self, f32) {
        pins.connect();
        RCC.ahb2enr().modify(|w| w.set_adc12en(true));
        ADC12_COMMON.ccr().modify(|w| {
            w.set_ckmode(Ckmode::ASYNCHRONOUS);
            w.set_presc(Presc::DIV4);
            w.set_vrefen(true);
        });
        let adc = ADC1;
        adc.cr().modify(|w| {
            w.set_deeppwd(false);
            w.set_advregen(true);
        });
        cortex_m::asm::delay(REGULATOR_US * (CORE_HZ / 1_000_000));
        adc.cr().modify(|w| w.set_adcaldif(Adcaldif::SINGLE_ENDED));
        adc.cr().modify(|w| w.set_adcal(true));
        while adc.cr().read().adcal() {}
        // Only while ADEN = 0 (RM0440, ADC_DIFSEL).
        adc.difsel().write(|w| {
            for channel in 0..18 {
                w.set_difsel(channel, Difsel::SINGLE_ENDED);
            }
        });
        // ADEN must not be set within four converter clocks after calibration (RM0440, ADC, "ADC on-off control").
        cortex_m::asm::delay(64);
        adc.isr().write(|w| w.set_adrdy(true));
        adc.cr().modify(|w| w.set_aden(true));
        while !adc.isr().read().adrdy() {}

        let supply_ratio = measure_supply_ratio();
        adc.smpr().write(|w| {
            for channel in [CURRENT_CHANNEL, SUPPLY_CHANNEL, TEMPERATURE_CHANNEL] {
                w.set_smp(usize::from(channel), SampleTime::CYCLES24_5);
            }
        });
        adc.cfgr2().write(|w| {
            w.set_jovse(true);
            // The sum of [`CONVERSIONS`] shifted right by two is a 12-bit code again.
            w.set_ovsr(0b001);
            w.set_ovss(2);
        });
        // No queue of contexts: the sequence never changes.
        adc.cfgr().modify(|w| w.set_jqdis(true));
        adc.jsqr().write(|w| {
            w.set_jl(2);
            w.set_jextsel(TRIGGER);
            w.set_jexten(Exten::RISING_EDGE);
            w.set_jsq(0, CURRENT_CHANNEL);
            w.set_jsq(1, SUPPLY_CHANNEL);
            w.set_jsq(2, TEMPERATURE_CHANNEL);
        });
        adc.ier().write(|w| w.set_jeosie(true));
        adc.cr().modify(|w| w.set_jadstart(true));
        (Self, supply_ratio)
    }

    /// Enables the interrupt, with the highest priority but that of the watch over it.
    pub(crate) fn enable_interrupt(&mut self) {
        interrupt::ADC1_2.set_priority(TICK_PRIORITY);
        // Everything that the handler owns was initialised before.
        #[allow(unsafe_code)]
        unsafe {
            interrupt::ADC1_2.enable();
        }
    }

    /// Reads the sequence that has just ended.
    #[inline(always)]
    pub(crate) fn read(&mut self) -> Codes {
        let adc = ADC1;
        // Writing one clears a flag.
        adc.isr().write(|w| {
            w.set_jeoc(true);
            w.set_jeos(true);
        });
        Codes {
            current: AdcCode(adc.jdr(0).read().jdata()),
            supply: AdcCode(adc.jdr(1).read().jdata()),
            temperature: AdcCode(adc.jdr(2).read().jdata()),
        }
    }

    /// Returns true if another sequence has ended since the last was read.
    #[inline(always)]
    pub(crate) fn is_waiting(&self) -> bool {
        ADC1.isr().read().jeos()
    }
}

/// Returns the ratio of the chip's supply to 3.3 V, from its own reference.
fn measure_supply_ratio() -> f32 {
    let adc = ADC1;
    cortex_m::asm::delay(REFERENCE_US * (CORE_HZ / 1_000_000));
    // At least 4 µs of sampling (DS12288, t_S_vrefint): 247.5 cycles are 5.8.
    adc.smpr2()
        .write(|w| w.set_smp(usize::from(REFERENCE_CHANNEL) - 10, SampleTime::CYCLES247_5));
    adc.sqr1().write(|w| w.set_sq(0, REFERENCE_CHANNEL));
    let mut sum = 0;
    for _ in 0..REFERENCE_READINGS {
        adc.cr().modify(|w| w.set_adstart(true));
        while !adc.isr().read().eoc() {}
        sum += u32::from(adc.dr().read().rdata());
    }
    let calibrated = u32::from(VREFINTCAL.data().read());
    let [over, under] = CALIBRATED_AT;
    (calibrated * REFERENCE_READINGS * over) as f32 / (sum.max(1) * under) as f32
}
