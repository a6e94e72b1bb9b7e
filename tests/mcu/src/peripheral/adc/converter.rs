//! The converter: clock, sequences and flags.

use crate::peripheral::{Bank, Refusal, Register, told};
use crate::time::{Instant, NEVER, UNITS_PER_MICROSECOND};

pub(super) const ISR: u32 = 0x00;
const IER: u32 = 0x04;
pub(super) const CR: u32 = 0x08;
const CFGR: u32 = 0x0C;
pub(super) const CFGR2: u32 = 0x10;
pub(super) const SMPR1: u32 = 0x14;
const SQR1: u32 = 0x30;
pub(super) const DR: u32 = 0x40;
pub(super) const JSQR: u32 = 0x4C;
pub(super) const JDR1: u32 = 0x80;
pub(super) const DIFSEL: u32 = 0xB0;
pub(super) const COMMON: u32 = 0x308;

pub(super) const ADEN: u32 = 1;
pub(super) const ADDIS: u32 = 1 << 1;
pub(super) const ADSTART: u32 = 1 << 2;
pub(super) const JADSTART: u32 = 1 << 3;
pub(super) const ADVREGEN: u32 = 1 << 28;
pub(super) const DEEPPWD: u32 = 1 << 29;
pub(super) const ADCAL: u32 = 1 << 31;
pub(super) const ADRDY: u32 = 1;
pub(super) const EOC: u32 = 1 << 2;
const EOS: u32 = 1 << 3;
const OVR: u32 = 1 << 4;
pub(super) const JEOC: u32 = 1 << 5;
pub(super) const JEOS: u32 = 1 << 6;

/// Start-up of the regulator (data sheet DS12288, table 66): 20 µs.
pub(super) const REGULATOR: u64 = 20 * UNITS_PER_MICROSECOND;
/// Calibration, cycles of the converter's clock (table 66).
pub(super) const CALIBRATION: u64 = 116;
/// Half cycles of the converter's clock from a trigger to the first sampling, asynchronous clock, typical (table 66,
/// t_LATRINJ).
pub(super) const LATENCY: u64 = 4;
/// Fastest clock with one converter in use, Hz (table 66).
const FASTEST: u64 = 60_000_000;

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "ADC_ISR", 0, 0),
    Register(0x04, "ADC_IER", 0, 0x0000_007F),
    Register(0x08, "ADC_CR", 0x2000_0000, 0xF000_003F),
    Register(0x0C, "ADC_CFGR", 0x8000_0000, 0x8070_BC78),
    Register(0x10, "ADC_CFGR2", 0, 0x0000_07FF),
    Register(0x14, "ADC_SMPR1", 0, 0xBFFF_FFFF),
    Register(0x18, "ADC_SMPR2", 0, 0x07FF_FFFF),
    Register(0x20, "ADC_TR1", 0x0FFF_0000, 0x0FFF_7FFF),
    Register(0x24, "ADC_TR2", 0x00FF_0000, 0x00FF_00FF),
    Register(0x28, "ADC_TR3", 0x00FF_0000, 0x00FF_00FF),
    Register(0x30, "ADC_SQR1", 0, 0x1F7D_F7CF),
    Register(0x34, "ADC_SQR2", 0, 0x1F7D_F7DF),
    Register(0x38, "ADC_SQR3", 0, 0x1F7D_F7DF),
    Register(0x3C, "ADC_SQR4", 0, 0x0000_07DF),
    Register(0x40, "ADC_DR", 0, 0),
    Register(0x4C, "ADC_JSQR", 0, 0xFBEF_BFFF),
    Register(0x60, "ADC_OFR1", 0, 0),
    Register(0x64, "ADC_OFR2", 0, 0),
    Register(0x68, "ADC_OFR3", 0, 0),
    Register(0x6C, "ADC_OFR4", 0, 0),
    Register(0x80, "ADC_JDR1", 0, 0),
    Register(0x84, "ADC_JDR2", 0, 0),
    Register(0x88, "ADC_JDR3", 0, 0),
    Register(0x8C, "ADC_JDR4", 0, 0),
    Register(0xA0, "ADC_AWD2CR", 0, 0),
    Register(0xA4, "ADC_AWD3CR", 0, 0),
    Register(0xB0, "ADC_DIFSEL", 0, 0),
    Register(0xB4, "ADC_CALFACT", 0, 0x007F_007F),
    Register(0xC0, "ADC_GCOMP", 0x1000, 0),
];

/// A conversion in progress.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conversion {
    ends: Instant,
    /// Rank from 0 among the injected ones; `None` for a regular one.
    pub(super) rank: Option<u32>,
    value: u32,
    last: bool,
}

/// A converter.
#[derive(Clone, Debug)]
pub struct Adc {
    pub(super) bank: Bank,
    pub(super) common: u32,
    pub(super) regulator: Option<Instant>,
    pub(super) calibrated: Instant,
    pub(super) under_way: Vec<Conversion>,
    /// Triggers during a running sequence.
    pub missed: u64,
}

impl Default for Adc {
    fn default() -> Self {
        Self {
            bank: Bank::new(REGISTERS),
            common: 0,
            regulator: None,
            calibrated: NEVER,
            under_way: Vec::new(),
            missed: 0,
        }
    }
}

/// Returns the 12-bit code of a channel's pin when a sample is held; `None` for an unconnected channel.
pub type Codes<'a> = &'a dyn Fn(u32, Instant) -> Option<u16>;

impl Adc {
    /// Returns the period of the converter's clock, from the AHB clock and the asynchronous one.
    pub(super) fn clock(&self, system: u64, kernel: Result<u64, Refusal>) -> Result<u64, Refusal> {
        const PRESCALERS: [u64; 12] = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256];
        let period = match self.common >> 16 & 3 {
            1 => system,
            2 => 2 * system,
            3 => 4 * system,
            _ => {
                let prescaler = (self.common >> 18 & 0xF) as usize;
                kernel? * PRESCALERS.get(prescaler).copied().unwrap_or(1)
            }
        };
        if crate::time::UNITS_PER_SECOND / period > FASTEST {
            return told(format!(
                "the converter's clock is {} Hz, above the {FASTEST} Hz that it stands",
                crate::time::UNITS_PER_SECOND / period
            ));
        }
        Ok(period)
    }

    /// Returns the half cycles of the sampling time of a channel.
    fn sampling(&self, channel: u32) -> u64 {
        let code = self.bank.get(SMPR1 + 4 * (channel / 10)) >> (3 * (channel % 10)) & 7;
        [5, 13, 25, 49, 95, 185, 495, 1281]
            .get(code as usize)
            .copied()
            .unwrap_or(5)
    }

    /// Returns end and result of a conversion that begins at `start`. A sample is held at the end of its sampling time.
    fn conversion(
        &self,
        channel: u32,
        start: Instant,
        clock: u64,
        injected: bool,
        codes: Codes<'_>,
    ) -> Result<(Instant, u32), Refusal> {
        let config = self.bank.get(CFGR);
        if config & 0x18 != 0 || config & 0x8000 != 0 {
            return told("resolutions below 12 bits and left alignment are not modelled");
        }
        let sampling = self.sampling(channel);
        let single = sampling + 25;
        let over = self.bank.get(CFGR2);
        let (ratio, shift) = if over & (if injected { 2 } else { 1 }) == 0 {
            (1, 0)
        } else {
            (2_u64 << (over >> 2 & 7), over >> 5 & 0xF)
        };
        let mut sum = 0;
        for k in 0..ratio {
            let held = start + (k * single + sampling) * clock / 2;
            let Some(code) = codes(channel, held) else {
                return told(format!("nothing is connected to ADC1 channel {channel}"));
            };
            sum += u32::from(code);
        }
        // Rounded (section 21.4.31).
        let result = (sum + ((1 << shift) >> 1)) >> shift;
        Ok((start + ratio * single * clock / 2, result & 0xFFFF))
    }

    /// Returns true if the hardware trigger `source` starts the injected sequence.
    pub fn listens_to(&self, source: u32) -> bool {
        let jsqr = self.bank.get(JSQR);
        self.bank.get(CR) & JADSTART != 0 && jsqr >> 7 & 3 != 0 && jsqr >> 2 & 0x1F == source
    }

    /// Starts the injected sequence.
    ///
    /// # Errors
    /// An unconnected channel, or a clock out of range.
    pub fn start_injected(
        &mut self,
        now: Instant,
        system: u64,
        kernel: Result<u64, Refusal>,
        codes: Codes<'_>,
    ) -> Result<(), Refusal> {
        if self.under_way.iter().any(|c| c.rank.is_some()) {
            self.missed += 1;
            return Ok(());
        }
        let clock = self.clock(system, kernel)?;
        let jsqr = self.bank.get(JSQR);
        let length = (jsqr & 3) + 1;
        let mut at = now + LATENCY * clock / 2;
        for rank in 0..length {
            let channel = jsqr >> (9 + 6 * rank) & 0x1F;
            let (ends, value) = self.conversion(channel, at, clock, true, codes)?;
            at = ends;
            self.under_way.push(Conversion {
                ends,
                rank: Some(rank),
                value,
                last: rank + 1 == length,
            });
        }
        Ok(())
    }

    pub(super) fn start_regular(
        &mut self,
        now: Instant,
        system: u64,
        kernel: Result<u64, Refusal>,
        codes: Codes<'_>,
    ) -> Result<(), Refusal> {
        let (config, sequence) = (self.bank.get(CFGR), self.bank.get(SQR1));
        if config & 0x2C03 != 0 || sequence & 0xF != 0 {
            return told("only single regular conversions by software are modelled");
        }
        let channel = sequence >> 6 & 0x1F;
        let clock = self.clock(system, kernel)?;
        let (ends, value) = self.conversion(channel, now, clock, false, codes)?;
        self.under_way.push(Conversion {
            ends,
            rank: None,
            value,
            last: true,
        });
        Ok(())
    }

    /// Returns the next end of a conversion.
    pub fn due(&self) -> Instant {
        self.under_way.iter().map(|c| c.ends).min().unwrap_or(NEVER)
    }

    /// Ends the conversions that are due.
    pub fn advance(&mut self, now: Instant) {
        if self.due() > now {
            return;
        }
        let (done, left): (Vec<_>, Vec<_>) = self.under_way.iter().partition(|c| c.ends <= now);
        self.under_way = left;
        for conversion in done {
            match conversion.rank {
                Some(rank) => {
                    self.bank.put(JDR1 + 4 * rank, conversion.value);
                    self.flag(JEOC | if conversion.last { JEOS } else { 0 });
                    if conversion.last && self.bank.get(JSQR) >> 7 & 3 == 0 {
                        let control = self.bank.get(CR) & !JADSTART;
                        self.bank.put(CR, control);
                    }
                }
                None => {
                    self.bank.put(DR, conversion.value);
                    let overrun = if self.bank.get(ISR) & EOC != 0 {
                        OVR
                    } else {
                        0
                    };
                    self.flag(EOC | EOS | overrun);
                    let control = self.bank.get(CR) & !ADSTART;
                    self.bank.put(CR, control);
                }
            }
        }
    }

    pub(super) fn flag(&mut self, bits: u32) {
        let status = self.bank.get(ISR) | bits;
        self.bank.put(ISR, status);
    }

    /// Returns true if an interrupt is requested.
    pub fn requests(&self) -> bool {
        self.bank.get(ISR) & self.bank.get(IER) != 0
    }
}
