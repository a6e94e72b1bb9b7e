//! Reset and clock control (RM0440 section 7.4).
//!
//! Oscillators are ready as soon as they are on, except a dead crystal. Left out: MCO, clocks of peripherals without a
//! model.

use super::{Bank, Refusal, Register, told};
use crate::map::Peripheral;
use crate::time::UNITS_PER_SECOND;

const CR: u32 = 0x00;
const CFGR: u32 = 0x08;
const PLLCFGR: u32 = 0x0C;
const AHB1RSTR: u32 = 0x28;
const APB2RSTR: u32 = 0x40;
const AHB1ENR: u32 = 0x48;
const AHB2ENR: u32 = 0x4C;
const APB1ENR1: u32 = 0x58;
const APB1ENR2: u32 = 0x5C;
const APB2ENR: u32 = 0x60;
const CCIPR: u32 = 0x88;
const BDCR: u32 = 0x90;
const CSR: u32 = 0x94;
const CRRCR: u32 = 0x98;

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    // HSION, HSIKERON, HSEON, HSEBYP, CSSON, PLLON.
    Register(0x00, "RCC_CR", 0x0000_0500, 0x010D_0300),
    Register(0x04, "RCC_ICSCR", 0x4000_0000, 0x7F00_0000),
    Register(0x08, "RCC_CFGR", 0x0000_0005, 0x0000_3FF3),
    Register(0x0C, "RCC_PLLCFGR", 0x0000_1000, 0xFF73_7FF3),
    Register(0x18, "RCC_CIER", 0, 0),
    Register(0x1C, "RCC_CIFR", 0, 0),
    Register(0x20, "RCC_CICR", 0, 0x0000_07FF),
    Register(0x28, "RCC_AHB1RSTR", 0, 0x0000_111F),
    Register(0x2C, "RCC_AHB2RSTR", 0, 0x050F_607F),
    Register(0x30, "RCC_AHB3RSTR", 0, 0x0000_0101),
    Register(0x38, "RCC_APB1RSTR1", 0, 0xD2FE_C93F),
    Register(0x3C, "RCC_APB1RSTR2", 0, 0x0000_0103),
    Register(0x40, "RCC_APB2RSTR", 0, 0x0437_F801),
    Register(0x48, "RCC_AHB1ENR", 0x0000_0100, 0x0000_111F),
    Register(0x4C, "RCC_AHB2ENR", 0, 0x050F_607F),
    Register(0x50, "RCC_AHB3ENR", 0, 0x0000_0101),
    Register(0x58, "RCC_APB1ENR1", 0x0000_0400, 0xD2FE_CD3F),
    Register(0x5C, "RCC_APB1ENR2", 0, 0x0000_0103),
    Register(0x60, "RCC_APB2ENR", 0, 0x0437_F801),
    Register(0x68, "RCC_AHB1SMENR", 0x0000_131F, 0x0000_131F),
    Register(0x6C, "RCC_AHB2SMENR", 0x050F_667F, 0x050F_667F),
    Register(0x70, "RCC_AHB3SMENR", 0x0000_0101, 0x0000_0101),
    Register(0x78, "RCC_APB1SMENR1", 0xD2FE_CD3F, 0xD2FE_CD3F),
    Register(0x7C, "RCC_APB1SMENR2", 0x0000_0103, 0x0000_0103),
    Register(0x80, "RCC_APB2SMENR", 0x0437_F801, 0x0437_F801),
    Register(0x88, "RCC_CCIPR", 0, 0xFFFF_FFFF),
    Register(0x90, "RCC_BDCR", 0, 0x0301_837D),
    // LSION, RMVF; hardware sets the reset flags.
    Register(0x94, "RCC_CSR", 0x0C00_0000, 0x0080_0001),
    Register(0x98, "RCC_CRRCR", 0, 0x0000_0001),
    Register(0x9C, "RCC_CCIPR2", 0, 0x0030_0003),
];

/// Reason of a reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cause {
    /// Power came on.
    #[default]
    PowerOn,
    /// AIRCR.SYSRESETREQ.
    Software,
    /// The independent watchdog.
    Watchdog,
    /// The window watchdog.
    WindowWatchdog,
    /// The reset button.
    Pin,
}

/// Result of a crystal's stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crystal {
    /// No change.
    Unchanged,
    /// The clock security system has replaced it by the chip's own oscillator.
    Replaced,
    /// The system clock has stopped too.
    Lost,
}

const HSEON: u32 = 1 << 16;
const CSSON: u32 = 1 << 19;
const PLLON: u32 = 1 << 24;
const CIFR: u32 = 0x1C;
const CSSF: u32 = 1 << 8;

/// The clock tree.
#[derive(Clone, Debug)]
pub struct Rcc {
    bank: Bank,
    crystal: bool,
}

impl Rcc {
    /// Returns the state after a reset.
    pub fn new(cause: Cause) -> Self {
        let mut bank = Bank::new(REGISTERS);
        // BORRSTF at power on; the other causes also pull the reset pin.
        let flags = match cause {
            Cause::PowerOn => 0x0C00_0000,
            Cause::Pin => 0x0400_0000,
            Cause::Software => 0x1400_0000,
            Cause::Watchdog => 0x2400_0000,
            Cause::WindowWatchdog => 0x4400_0000,
        };
        bank.put(CSR, flags);
        Self {
            bank,
            crystal: true,
        }
    }

    /// Starts or stops the crystal. If a stopped crystal feeds the system clock, directly or by the PLL, the clock
    /// security system (CR.CSSON) changes to HSI, switches HSE and PLL off and sets its flag (RM0440 section 7.2.10).
    pub fn set_crystal(&mut self, swings: bool) -> Crystal {
        self.crystal = swings;
        let (control, config) = (self.bank.get(CR), self.bank.get(CFGR));
        if swings || control & HSEON == 0 {
            return Crystal::Unchanged;
        }
        let source = config & 3;
        let used = source == 2 || source == 3 && self.bank.get(PLLCFGR) & 3 == 3;
        if control & CSSON == 0 {
            return if used {
                Crystal::Lost
            } else {
                Crystal::Unchanged
            };
        }
        let off = HSEON | CSSON | if used { PLLON } else { 0 };
        self.bank.put(CR, control & !off | 0x100);
        if used {
            self.bank.put(CFGR, config & !3 | 1);
        }
        let flags = self.bank.get(CIFR) | CSSF;
        self.bank.put(CIFR, flags);
        Crystal::Replaced
    }

    /// Returns CIFR.CSSF: true if the security system has acted and the flag is not cleared.
    pub fn clock_failed(&self) -> bool {
        self.bank.get(CIFR) & CSSF != 0
    }

    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        let value = self.bank.read(offset)?;
        Ok(match offset {
            // HSIRDY, HSERDY, PLLRDY follow their switches.
            CR => {
                let swinging = value & (if self.crystal { 0x0101_0000 } else { PLLON });
                (value & !0x0202_0400) | (value & 0x100) << 2 | swinging << 1
            }
            CFGR => (value & !0xC) | (value & 3) << 2,
            // LSERDY, LSIRDY, HSI48RDY.
            BDCR | CSR | CRRCR => (value & !2) | (value & 1) << 1,
            _ => value,
        })
    }

    /// A store. Returns true if clocks may have changed.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<bool, Refusal> {
        // Ready bits may be written back as read.
        let value = match offset {
            CR => value & !0x0202_0400,
            CFGR => value & !0xC,
            BDCR | CRRCR => value & !2,
            CSR => value & !2,
            _ => value,
        };
        self.bank.write(offset, value)?;
        if offset == CSR && value & 1 << 23 != 0 {
            let kept = self.bank.get(CSR) & 1;
            self.bank.put(CSR, kept);
        }
        if offset == 0x20 {
            let flags = self.bank.get(CIFR) & !value;
            self.bank.put(CIFR, flags);
            self.bank.put(0x20, 0);
        }
        Ok(matches!(offset, CR | CFGR | PLLCFGR | CCIPR))
    }

    /// Returns true for the offset of a reset register.
    pub fn is_reset(offset: u32) -> bool {
        (AHB1RSTR..=APB2RSTR).contains(&offset)
    }

    /// Returns the frequency of the PLL's R output, Hz.
    fn pll(&self) -> Result<u64, Refusal> {
        let config = self.bank.get(PLLCFGR);
        let input = match config & 3 {
            2 => 16_000_000,
            3 => 24_000_000,
            _ => return told("the PLL has no input clock (PLLSRC)"),
        };
        let m = u64::from(config >> 4 & 0xF) + 1;
        let n = u64::from(config >> 8 & 0x7F);
        let r = 2 * (u64::from(config >> 25 & 3) + 1);
        let vco_in = input / m;
        let vco = input * n / m;
        if !(2_660_000..=16_000_000).contains(&vco_in) || !(96_000_000..=344_000_000).contains(&vco)
        {
            return told(format!(
                "the PLL is outside its range: {vco_in} Hz in, {vco} Hz at the oscillator"
            ));
        }
        Ok(vco / r)
    }

    /// Returns the system clock, Hz.
    ///
    /// # Errors
    /// A source that is off, or a frequency that the time base does not divide.
    pub fn system_clock(&self) -> Result<u64, Refusal> {
        let on = self.bank.get(CR);
        let frequency = match self.bank.get(CFGR) & 3 {
            1 if on & 0x100 != 0 => 16_000_000,
            2 if on & 0x1_0000 != 0 => 24_000_000,
            3 if on & 0x100_0000 != 0 => self.pll()?,
            source => {
                return told(format!(
                    "the system clock source {source} is off or reserved"
                ));
            }
        };
        let divided = match self.bank.get(CFGR) >> 4 & 0xF {
            n @ 0..=7 => {
                let _ = n;
                frequency
            }
            n @ 8..=11 => frequency >> (n - 7),
            n => frequency >> (n - 6),
        };
        if !UNITS_PER_SECOND.is_multiple_of(divided) {
            return told(format!(
                "a clock of {divided} Hz does not divide the emulation's time base of {UNITS_PER_SECOND} Hz"
            ));
        }
        Ok(divided)
    }

    /// Returns the divider of an APB clock from the system clock.
    fn apb_shift(&self, second: bool) -> u32 {
        let bits = self.bank.get(CFGR) >> (if second { 11 } else { 8 }) & 7;
        bits.saturating_sub(3)
    }

    /// Returns the time units of one period of a timer's kernel clock: the APB clock, doubled if that is divided.
    ///
    /// # Errors
    /// As [`Rcc::system_clock`].
    pub fn timer_period(&self, timer: u8) -> Result<u64, Refusal> {
        let second = matches!(timer, 1 | 8 | 15 | 16 | 17 | 20);
        let shift = self.apb_shift(second).saturating_sub(1);
        Ok((UNITS_PER_SECOND / self.system_clock()?) << shift)
    }

    /// Returns the time units of one period of the system clock.
    ///
    /// # Errors
    /// As [`Rcc::system_clock`].
    pub fn system_period(&self) -> Result<u64, Refusal> {
        Ok(UNITS_PER_SECOND / self.system_clock()?)
    }

    /// Returns the time units of one period of the APB1 clock.
    ///
    /// # Errors
    /// As [`Rcc::system_clock`].
    pub fn apb1_period(&self) -> Result<u64, Refusal> {
        Ok(self.system_period()? << self.apb_shift(false))
    }

    /// Returns the time units of one period of LPUART1's kernel clock.
    ///
    /// # Errors
    /// As [`Rcc::system_clock`].
    pub fn lpuart_period(&self) -> Result<u64, Refusal> {
        let system = self.system_period()?;
        match self.bank.get(CCIPR) >> 10 & 3 {
            0 => Ok(system << self.apb_shift(false)),
            1 => Ok(system),
            2 => Ok(UNITS_PER_SECOND / 16_000_000),
            _ => told("LPUART1 by LSE is not modelled"),
        }
    }

    /// Returns the time units of one period of the asynchronous clock of ADC1 and ADC2.
    ///
    /// # Errors
    /// As [`Rcc::system_clock`].
    pub fn adc_period(&self) -> Result<u64, Refusal> {
        match self.bank.get(CCIPR) >> 28 & 3 {
            2 => self.system_period(),
            1 => {
                let config = self.bank.get(PLLCFGR);
                if config & 1 << 16 == 0 {
                    return told("ADC12 runs by the PLL's P output, which is off");
                }
                let r = 2 * (u64::from(config >> 25 & 3) + 1);
                let p = match config >> 27 {
                    0 if config & 1 << 17 != 0 => 17,
                    0 => 7,
                    p => u64::from(p),
                };
                let vco = self.pll()? * r;
                // Rounded to the time base: a conversion's time is off by less than a part in 10⁴.
                Ok(UNITS_PER_SECOND * p / vco)
            }
            _ => told("ADC12 has no kernel clock (CCIPR.ADC12SEL)"),
        }
    }

    /// Returns true if a peripheral's clock is on.
    pub fn is_clocked(&self, peripheral: Peripheral) -> bool {
        let (register, bit) = match peripheral {
            Peripheral::Tim(n @ 2..=7) => (APB1ENR1, u32::from(n) - 2),
            Peripheral::Tim(1) => (APB2ENR, 11),
            Peripheral::Tim(8) => (APB2ENR, 13),
            Peripheral::Tim(n @ 15..=17) => (APB2ENR, u32::from(n) + 1),
            Peripheral::Tim(_) => (APB2ENR, 20),
            Peripheral::Wwdg => (APB1ENR1, 11),
            Peripheral::Pwr => (APB1ENR1, 28),
            Peripheral::Lpuart => (APB1ENR2, 0),
            Peripheral::Syscfg | Peripheral::Comp => (APB2ENR, 0),
            Peripheral::Dma(n) => (AHB1ENR, u32::from(n) - 1),
            Peripheral::Dmamux => (AHB1ENR, 2),
            Peripheral::Flash => (AHB1ENR, 8),
            Peripheral::Gpio(n) => (AHB2ENR, u32::from(n)),
            Peripheral::Adc12 => (AHB2ENR, 13),
            Peripheral::Dac3 => (AHB2ENR, 18),
            Peripheral::Exti
            | Peripheral::Rcc
            | Peripheral::Iwdg
            | Peripheral::Dwt
            | Peripheral::Scs
            | Peripheral::Dbgmcu => return true,
        };
        self.bank.get(register) & 1 << bit != 0
    }

    /// Returns true if a peripheral is held in reset.
    pub fn is_held(&self, peripheral: Peripheral) -> bool {
        let (register, bit) = match peripheral {
            Peripheral::Tim(n @ 2..=7) => (0x38, u32::from(n) - 2),
            Peripheral::Tim(1) => (APB2RSTR, 11),
            Peripheral::Tim(8) => (APB2RSTR, 13),
            Peripheral::Tim(n @ 15..=17) => (APB2RSTR, u32::from(n) + 1),
            Peripheral::Tim(_) => (APB2RSTR, 20),
            Peripheral::Pwr => (0x38, 28),
            Peripheral::Lpuart => (0x3C, 0),
            // One reset for the configuration, the comparators and the reference buffer.
            Peripheral::Syscfg | Peripheral::Comp => (APB2RSTR, 0),
            Peripheral::Dma(n) => (AHB1RSTR, u32::from(n) - 1),
            Peripheral::Dmamux => (AHB1RSTR, 2),
            Peripheral::Flash => (AHB1RSTR, 8),
            Peripheral::Gpio(n) => (0x2C, u32::from(n)),
            Peripheral::Adc12 => (0x2C, 13),
            Peripheral::Dac3 => (0x2C, 18),
            Peripheral::Exti
            | Peripheral::Rcc
            | Peripheral::Iwdg
            | Peripheral::Wwdg
            | Peripheral::Dwt
            | Peripheral::Scs
            | Peripheral::Dbgmcu => return false,
        };
        self.bank.get(register) & 1 << bit != 0
    }
}
