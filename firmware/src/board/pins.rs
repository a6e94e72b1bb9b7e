//! Wiring: the only file that names pins. The table in `docs/firmware.md` has the same content.

use embassy_stm32::gpio::{AfType, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac::gpio::vals::{Idr, Pupdr};
use embassy_stm32::pac::{GPIOA, GPIOB};
use embassy_stm32::peripherals::{
    DMA1_CH1, DMA1_CH2, LPUART1, PA0, PA1, PA2, PA3, PA5, PA8, PA9, PA15, PB0, PB5, PB12, PB14,
    PB15, PC0, PC1, PC2,
};
use embassy_stm32::{Peri, Peripherals};

use super::clock::CORE_HZ;

/// TIM1 and its break input on PA8, PA9 and PB12 (STM32G474 data sheet DS12288, "Alternate function").
const AF_TIM1: u8 = 6;
/// TIM2 channels 1 and 2 on PA0 and PA1.
const AF_TIM2: u8 = 1;
/// TIM2's external trigger on PA15.
const AF_TIM2_ETR: u8 = 14;

/// Converter channels of ADC1.
pub(crate) const CURRENT_CHANNEL: u8 = 7; // PC1
pub(crate) const SUPPLY_CHANNEL: u8 = 6; // PC0
pub(crate) const TEMPERATURE_CHANNEL: u8 = 8; // PC2

/// The pins of the bridge, not yet driven.
pub(crate) struct BridgePins {
    pub(crate) enable: Output<'static>,
    in1: Peri<'static, PA8>,
    in2: Peri<'static, PA9>,
    fault: Peri<'static, PB12>,
}

/// Drives the bridge's enable (PB5) low, from anywhere, with one store.
#[inline(always)]
pub(crate) fn disable_bridge() {
    GPIOB.bsrr().write(|w| w.set_br(5, true));
}

/// The serial line to the ST-LINK.
pub(crate) struct LinkPins {
    pub(crate) uart: Peri<'static, LPUART1>,
    pub(crate) tx: Peri<'static, PA2>,
    pub(crate) rx: Peri<'static, PA3>,
    pub(crate) tx_dma: Peri<'static, DMA1_CH1>,
    pub(crate) rx_dma: Peri<'static, DMA1_CH2>,
}

/// All pins.
pub(crate) struct Pins {
    pub(crate) bridge: BridgePins,
    pub(crate) encoder: EncoderPins,
    pub(crate) analog: AnalogPins,
    pub(crate) stop: StopPins,
    pub(crate) link: LinkPins,
    pub(crate) led: Output<'static>,
}

/// The encoder's channels and index.
pub(crate) struct EncoderPins {
    a: Peri<'static, PA0>,
    b: Peri<'static, PA1>,
    index: Peri<'static, PA15>,
}

/// The stop switch, and the strap that says that one is fitted; both against ground.
pub(crate) struct StopPins {
    switch: Peri<'static, PB14>,
    strap: Peri<'static, PB15>,
}

/// Time in which an open line is pulled high, µs: 55 kΩ (DS12288, R_PU at most) and 10 nF, nine time constants.
const STOP_SETTLING_US: u32 = 5000;
/// The switch's pin, PB14, in GPIOB.
const STOP_PIN: u32 = 14;

impl StopPins {
    /// Sets both pins up, and finds out whether a switch is fitted: the strap says so, or the switch is closed now. Waits
    /// 5 ms.
    pub(crate) fn connect(self) -> StopInput {
        let [switch, strap] = [Flex::new(self.switch), Flex::new(self.strap)].map(|mut pin| {
            pin.set_as_input(Pull::Up);
            pin
        });
        cortex_m::asm::delay(STOP_SETTLING_US * (CORE_HZ / 1_000_000));
        let fitted = strap.is_low() || switch.is_low();
        // A dropped `Flex` disconnects its pin.
        core::mem::forget((switch, strap));
        StopInput {
            open: u32::from(fitted) << STOP_PIN,
        }
    }
}

/// The input of the stop switch.
pub(crate) struct StopInput {
    /// Bit of its pin in GPIOB, which is high if the switch is open; 0 if no switch is fitted.
    open: u32,
}

impl StopInput {
    /// Returns true if a fitted switch is open. One reading, the same cycles whether one is fitted or not.
    #[inline(always)]
    pub(crate) fn is_open(&self) -> bool {
        GPIOB.idr().read().0 & self.open != 0
    }

    /// Returns true if a switch is fitted.
    pub(crate) fn is_fitted(&self) -> bool {
        self.open != 0
    }
}

/// Current, supply, temperature.
pub(crate) struct AnalogPins {
    /// Also the positive input of COMP3 (DS12288, pin definitions; RM0440, COMP, "non-inverting input assignment").
    current: Peri<'static, PC1>,
    /// The same wire, connected to the positive input of COMP4.
    current_again: Peri<'static, PB0>,
    supply: Peri<'static, PC0>,
    temperature: Peri<'static, PC2>,
}

impl Pins {
    /// Sorts the chip's pins. Drives the bridge's enable low at once.
    pub(crate) fn new(p: Peripherals) -> Self {
        let enable: Peri<'static, PB5> = p.PB5;
        let led: Peri<'static, PA5> = p.PA5;
        Self {
            bridge: BridgePins {
                enable: Output::new(enable, Level::Low, Speed::Low),
                in1: p.PA8,
                in2: p.PA9,
                fault: p.PB12,
            },
            encoder: EncoderPins {
                a: p.PA0,
                b: p.PA1,
                index: p.PA15,
            },
            analog: AnalogPins {
                current: p.PC1,
                current_again: p.PB0,
                supply: p.PC0,
                temperature: p.PC2,
            },
            stop: StopPins {
                switch: p.PB14,
                strap: p.PB15,
            },
            link: LinkPins {
                uart: p.LPUART1,
                tx: p.PA2,
                rx: p.PA3,
                tx_dma: p.DMA1_CH1,
                rx_dma: p.DMA1_CH2,
            },
            led: Output::new(led, Level::Low, Speed::Low),
        }
    }
}

/// Pins of channels A and B in GPIOA, and the register values of their pulls (RM0440, GPIOx_PUPDR: 1 up, 2 down).
const CHANNELS: [usize; 2] = [0, 1];

/// Returns the pin of a channel. Not looked up by index: then rustc 1.90 does not see that it is below 16, and adds a
/// panic to the register access.
#[inline(always)]
fn pin(channel: usize) -> usize {
    let [a, b] = CHANNELS;
    if channel & 1 == 0 { a } else { b }
}

/// Pulls a channel of the encoder up or down. This does not change a driven line.
#[inline(always)]
pub(crate) fn pull(channel: usize, up: bool) {
    let pull = if up { Pupdr::PULL_UP } else { Pupdr::PULL_DOWN };
    GPIOA.pupdr().modify(|w| w.set_pupdr(pin(channel), pull));
}

/// Returns true if a channel of the encoder is high.
#[inline(always)]
pub(crate) fn is_high(channel: usize) -> bool {
    GPIOA.idr().read().idr(pin(channel)) == Idr::HIGH
}

/// Returns true if both inputs of the bridge, PA8 and PA9, have this level.
pub(crate) fn are_bridge_inputs(high: bool) -> bool {
    let wanted = if high { Idr::HIGH } else { Idr::LOW };
    let levels = GPIOA.idr().read();
    levels.idr(8) == wanted && levels.idr(9) == wanted
}

/// Returns true if the enable of the bridge, PB5, is low.
pub(crate) fn is_bridge_asleep() -> bool {
    GPIOB.idr().read().idr(5) == Idr::LOW
}

impl BridgePins {
    /// Connects the outputs and the break input to TIM1, which must already hold its outputs idle.
    pub(crate) fn connect(self) -> Output<'static> {
        let output = AfType::output(OutputType::PushPull, Speed::Medium);
        // The driver's fault output is an open drain.
        let fault = AfType::input(Pull::Up);
        set_alternate_function(Flex::new(self.in1), AF_TIM1, output);
        set_alternate_function(Flex::new(self.in2), AF_TIM1, output);
        set_alternate_function(Flex::new(self.fault), AF_TIM1, fault);
        self.enable
    }
}

impl EncoderPins {
    /// Connects the encoder to TIM2.
    pub(crate) fn connect(self) {
        // A disconnected wire stays at a level instead of counting noise.
        set_alternate_function(Flex::new(self.a), AF_TIM2, AfType::input(Pull::Up));
        set_alternate_function(Flex::new(self.b), AF_TIM2, AfType::input(Pull::Up));
        set_alternate_function(
            Flex::new(self.index),
            AF_TIM2_ETR,
            AfType::input(Pull::Down),
        );
    }
}

impl AnalogPins {
    /// Connects the inputs to the converter and the comparators.
    pub(crate) fn connect(self) {
        for mut pin in [
            Flex::new(self.current),
            Flex::new(self.current_again),
            Flex::new(self.supply),
            Flex::new(self.temperature),
        ] {
            pin.set_as_analog();
            core::mem::forget(pin);
        }
    }
}

/// Sets a pin to an alternate function permanently: a dropped `Flex` disconnects its pin.
fn set_alternate_function(mut pin: Flex<'static>, function: u8, kind: AfType) {
    pin.set_as_af_unchecked(function, kind);
    core::mem::forget(pin);
}
