//! Memory map (RM0440 rev 8, section 2.2 "Memory map").

use core::ops::Range;

/// Main flash memory, 512 KiB in two banks.
pub const FLASH: Range<u32> = 0x0800_0000..0x0808_0000;
/// SRAM1, SRAM2 and the alias of the CCM SRAM, one after the other.
pub const RAM: Range<u32> = 0x2000_0000..0x2002_0000;
/// The CCM SRAM by its own bus, for code.
pub const CCM: Range<u32> = 0x1000_0000..0x1000_8000;
/// System memory, one-time programmable area, calibration values and option bytes.
pub const SYSTEM: Range<u32> = 0x1FFF_0000..0x1FFF_8000;
/// APB1 to AHB2.
pub const PERIPHERALS: Range<u32> = 0x4000_0000..0x5006_1000;
/// Private peripheral bus of the core, and the debug unit.
pub const CORE: Range<u32> = 0xE000_0000..0xE010_0000;

/// A peripheral of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peripheral {
    /// Timer by its number.
    Tim(u8),
    /// Independent watchdog.
    Iwdg,
    /// Window watchdog.
    Wwdg,
    /// Power control.
    Pwr,
    /// Low-power UART.
    Lpuart,
    /// System configuration, with voltage reference buffer and operational amplifiers behind it.
    Syscfg,
    /// Comparators 1 to 7.
    Comp,
    /// DAC3.
    Dac3,
    /// External interrupts.
    Exti,
    /// DMA controller, 1 or 2.
    Dma(u8),
    /// DMA request multiplexer.
    Dmamux,
    /// Clocks.
    Rcc,
    /// Flash controller.
    Flash,
    /// Port A to G as 0 to 6.
    Gpio(u8),
    /// ADC1 and ADC2 with their common registers.
    Adc12,
    /// Data watchpoint and trace: the cycle counter.
    Dwt,
    /// System control space: SysTick, NVIC, SCB, MPU, debug, FPU.
    Scs,
    /// Debug unit of the chip.
    Dbgmcu,
}

/// Base address and size of every peripheral that is modelled.
const PLACES: [(u32, u32, Peripheral); 36] = [
    (0x4000_0000, 0x400, Peripheral::Tim(2)),
    (0x4000_0400, 0x400, Peripheral::Tim(3)),
    (0x4000_0800, 0x400, Peripheral::Tim(4)),
    (0x4000_0C00, 0x400, Peripheral::Tim(5)),
    (0x4000_1000, 0x400, Peripheral::Tim(6)),
    (0x4000_1400, 0x400, Peripheral::Tim(7)),
    (0x4000_2C00, 0x400, Peripheral::Wwdg),
    (0x4000_3000, 0x400, Peripheral::Iwdg),
    (0x4000_7000, 0x400, Peripheral::Pwr),
    (0x4000_8000, 0x400, Peripheral::Lpuart),
    (0x4001_0000, 0x30, Peripheral::Syscfg),
    (0x4001_0200, 0x100, Peripheral::Comp),
    (0x4001_0400, 0x400, Peripheral::Exti),
    (0x4001_2C00, 0x400, Peripheral::Tim(1)),
    (0x4001_3400, 0x400, Peripheral::Tim(8)),
    (0x4001_4000, 0x400, Peripheral::Tim(15)),
    (0x4001_4400, 0x400, Peripheral::Tim(16)),
    (0x4001_4800, 0x400, Peripheral::Tim(17)),
    (0x4001_5000, 0x400, Peripheral::Tim(20)),
    (0x4002_0000, 0x400, Peripheral::Dma(1)),
    (0x4002_0400, 0x400, Peripheral::Dma(2)),
    (0x4002_0800, 0x400, Peripheral::Dmamux),
    (0x4002_1000, 0x400, Peripheral::Rcc),
    (0x4002_2000, 0x400, Peripheral::Flash),
    (0x4800_0000, 0x400, Peripheral::Gpio(0)),
    (0x4800_0400, 0x400, Peripheral::Gpio(1)),
    (0x4800_0800, 0x400, Peripheral::Gpio(2)),
    (0x4800_0C00, 0x400, Peripheral::Gpio(3)),
    (0x4800_1000, 0x400, Peripheral::Gpio(4)),
    (0x4800_1400, 0x400, Peripheral::Gpio(5)),
    (0x4800_1800, 0x400, Peripheral::Gpio(6)),
    (0x5000_0000, 0x400, Peripheral::Adc12),
    (0x5000_1000, 0x400, Peripheral::Dac3),
    (0xE000_1000, 0x1000, Peripheral::Dwt),
    (0xE000_E000, 0x1000, Peripheral::Scs),
    (0xE004_2000, 0x400, Peripheral::Dbgmcu),
];

/// Returns the peripheral at an address, with its base.
pub fn peripheral(address: u32) -> Option<(Peripheral, u32)> {
    PLACES
        .iter()
        .find(|(base, size, _)| address.wrapping_sub(*base) < *size)
        .map(|(base, _, peripheral)| (*peripheral, *base))
}

/// Peripherals of the chip that are not modelled, so that an access can be named.
const UNMODELLED: [(u32, &str); 32] = [
    (0x4000_2000, "CRS"),
    (0x4000_2400, "TAMP"),
    (0x4000_2800, "RTC"),
    (0x4000_3800, "SPI2"),
    (0x4000_3C00, "SPI3"),
    (0x4000_4400, "USART2"),
    (0x4000_4800, "USART3"),
    (0x4000_4C00, "UART4"),
    (0x4000_5000, "UART5"),
    (0x4000_5400, "I2C1"),
    (0x4000_5800, "I2C2"),
    (0x4000_5C00, "USB"),
    (0x4000_6400, "FDCAN1"),
    (0x4000_7800, "I2C3"),
    (0x4000_7C00, "LPTIM1"),
    (0x4000_8400, "I2C4"),
    (0x4000_A000, "UCPD1"),
    (0x4001_0030, "VREFBUF"),
    (0x4001_0300, "OPAMP"),
    (0x4001_3000, "SPI1"),
    (0x4001_3800, "USART1"),
    (0x4001_3C00, "SPI4"),
    (0x4001_5400, "SAI1"),
    (0x4001_6800, "HRTIM"),
    (0x4002_0C00, "CORDIC"),
    (0x4002_1400, "FMAC"),
    (0x4002_3000, "CRC"),
    (0x5000_0400, "ADC3/4/5"),
    (0x5000_0800, "DAC1/2"),
    (0x5006_0000, "AES"),
    (0x5006_0800, "RNG"),
    (0xE000_0000, "ITM"),
];

/// Returns the name of the peripheral or memory at an address, modelled or not.
pub fn name(address: u32) -> String {
    if let Some((peripheral, base)) = peripheral(address) {
        return format!("{peripheral:?}+{:#x}", address - base);
    }
    let below = UNMODELLED
        .iter()
        .filter(|(base, _)| *base <= address && address - base < 0x2000)
        .max_by_key(|(base, _)| *base);
    match below {
        Some((base, name)) => format!(
            "{name}+{:#x} (a peripheral without a model)",
            address - base
        ),
        None => format!("{address:#010x} (nothing known there)"),
    }
}
