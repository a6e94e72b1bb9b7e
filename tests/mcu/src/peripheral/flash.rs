//! Flash controller (RM0440 section 3.7): latency, unlocking, erasing pages and programming double words, with their
//! times. Dual-bank, pages of 2 KiB. A fetch from a busy bank waits (section 3.3.2, read-while-write works across banks
//! only).
//!
//! Left out: fast programming, option bytes, protection; ECC except the flag of an error that a test sets.

use super::{Bank, Refusal, Register, told};
use crate::cpu::Memory;
use crate::map::FLASH;
use crate::time::{Instant, NEVER, UNITS_PER_MICROSECOND};

/// Typical times (STM32G474 data sheet DS12288, table 53): double word 81.69 µs, page 22.02 ms.
const PROGRAM: u64 = 82 * UNITS_PER_MICROSECOND;
const ERASE: u64 = 22_020 * UNITS_PER_MICROSECOND;
const BANK: u32 = 0x4_0000;
const PAGE: u32 = 0x800;

const ACR: u32 = 0x00;
const KEYR: u32 = 0x08;
const SR: u32 = 0x10;
const CR: u32 = 0x14;
const ECCR: u32 = 0x18;

/// Data cache: on, reset.
const DCEN: u32 = 1 << 10;
const DCRST: u32 = 1 << 12;
/// Writing one clears it.
const ECCD: u32 = 1 << 31;
const EOP: u32 = 1;
const PROGERR: u32 = 1 << 3;
const PGAERR: u32 = 1 << 5;
const SIZERR: u32 = 1 << 6;
const PGSERR: u32 = 1 << 7;
const BSY: u32 = 1 << 16;
const PG: u32 = 1;
const PER: u32 = 1 << 1;
const STRT: u32 = 1 << 16;
const EOPIE: u32 = 1 << 24;
const ERRIE: u32 = 1 << 25;
const LOCK: u32 = 1 << 31;

#[rustfmt::skip]
const REGISTERS: &[Register] = &[
    Register(0x00, "FLASH_ACR", 0x0004_0600, 0x0004_7F0F),
    Register(0x08, "FLASH_KEYR", 0, 0xFFFF_FFFF),
    Register(0x0C, "FLASH_OPTKEYR", 0, 0),
    Register(0x10, "FLASH_SR", 0, 0x0000_C3FB),
    // PG, PER, PNB, BKER, STRT, interrupts, LOCK. OPTLOCK stays set.
    Register(0x14, "FLASH_CR", 0xC000_0000, 0x8301_0BFB),
    Register(0x18, "FLASH_ECCR", 0, 0x0100_0000),
    // DBANK set: two banks of 64-bit words.
    Register(0x20, "FLASH_OPTR", 0xFFEF_F8AA, 0),
];

#[derive(Clone, Copy, Debug)]
enum Job {
    Erase(u32),
    Program(u32, [u8; 8]),
}

/// The controller.
#[derive(Clone, Debug)]
pub struct Flash {
    bank: Bank,
    /// Keys given so far; 3 after a wrong one: locked until reset.
    keys: u8,
    job: Option<(Instant, Job)>,
    /// First word of a double word that waits for its second.
    half: Option<(u32, u32)>,
    /// Pages erased and double words programmed since power on.
    pub work: (u32, u32),
}

impl Default for Flash {
    fn default() -> Self {
        Self {
            bank: Bank::new(REGISTERS),
            keys: 0,
            job: None,
            half: None,
            work: (0, 0),
        }
    }
}

impl Flash {
    /// Returns the set wait states.
    pub fn latency(&self) -> u32 {
        self.bank.get(ACR) & 0xF
    }

    /// Returns true if the instruction cache is on.
    pub fn caches(&self) -> bool {
        self.bank.get(ACR) & 0x200 != 0
    }

    /// Returns true if the prefetch is on.
    pub fn prefetches(&self) -> bool {
        self.bank.get(ACR) & 0x100 != 0
    }

    /// Handles the reading of a word with two wrong bits in bank 1 or 2 (FLASH_ECCR: ECCD, BK_ECC).
    pub fn double_error(&mut self, bank: u8) {
        self.bank.put(ECCR, ECCD | u32::from(bank == 2) << 21);
    }

    /// Handles AHB1RSTR.FLASHRST: the registers return to their values after reset; work done is still counted.
    pub fn reset(&mut self) {
        *self = Self {
            work: self.work,
            ..Self::default()
        };
    }

    /// Returns the end of the present operation.
    pub fn due(&self) -> Instant {
        self.job.map_or(NEVER, |(end, _)| end)
    }

    /// Returns the time until which a fetch from `address` has to wait.
    pub fn stalls(&self, address: u32) -> Option<Instant> {
        let (end, job) = self.job?;
        let (Job::Erase(at) | Job::Program(at, _)) = job;
        let same = (at - FLASH.start) / BANK == address.wrapping_sub(FLASH.start) / BANK;
        same.then_some(end)
    }

    /// Returns true if an interrupt is requested.
    pub fn requests(&self) -> bool {
        let (status, control) = (self.bank.get(SR), self.bank.get(CR));
        status & EOP != 0 && control & EOPIE != 0 || status & 0xFA != 0 && control & ERRIE != 0
    }

    /// Ends the present operation. Returns the first address and length of the change.
    pub fn finish(&mut self, memory: &mut dyn Memory) -> Option<(u32, u32)> {
        let (_, job) = self.job.take()?;
        let status = self.bank.get(SR) & !BSY;
        // EOP is set only if its interrupt is enabled (section 3.7.5).
        let end = if self.bank.get(CR) & EOPIE != 0 {
            EOP
        } else {
            0
        };
        self.bank.put(SR, status | end);
        match job {
            Job::Erase(address) => {
                self.work.0 += 1;
                let control = self.bank.get(CR) & !STRT;
                self.bank.put(CR, control);
                memory.store(address, &[0xFF; PAGE as usize]);
                Some((address, PAGE))
            }
            Job::Program(address, bytes) => {
                self.work.1 += 1;
                memory.store(address, &bytes);
                Some((address, 8))
            }
        }
    }

    fn fail(&mut self, error: u32) {
        let status = self.bank.get(SR) | error;
        self.bank.put(SR, status);
    }

    /// Stores into the memory itself.
    ///
    /// # Errors
    /// An operation that is not modelled.
    pub fn store(
        &mut self,
        now: Instant,
        memory: &mut dyn Memory,
        address: u32,
        size: u32,
        value: u32,
    ) -> Result<(), Refusal> {
        let control = self.bank.get(CR);
        if control & LOCK != 0 || control & PG == 0 {
            self.fail(PGSERR);
            return Ok(());
        }
        if size != 4 {
            self.fail(SIZERR);
            return Ok(());
        }
        match self.half.take() {
            None if address.is_multiple_of(8) => self.half = Some((address, value)),
            Some((first, low)) if address == first + 4 => {
                let mut before = [0; 8];
                memory.load(first, &mut before);
                let mut bytes = [0; 8];
                for (to, from) in bytes
                    .iter_mut()
                    .zip(low.to_le_bytes().into_iter().chain(value.to_le_bytes()))
                {
                    *to = from;
                }
                // Only an erased double word can be programmed; any double word can be set to zero (section 3.3.7).
                if before != [0xFF; 8] && bytes != [0; 8] {
                    self.fail(PROGERR);
                    return Ok(());
                }
                if self.job.is_some() {
                    return told("a double word was programmed while the flash memory was busy");
                }
                if self.bank.get(ACR) & DCEN != 0 {
                    return told(
                        "a double word was programmed with the data cache on (FLASH_ACR.DCEN): reads of the other bank may then corrupt the cache (errata ES0430, 2.2.2)",
                    );
                }
                self.job = Some((now + PROGRAM, Job::Program(first, bytes)));
                let status = self.bank.get(SR) | BSY;
                self.bank.put(SR, status);
            }
            _ => self.fail(PGAERR),
        }
        Ok(())
    }

    /// A load.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn read(&self, offset: u32) -> Result<u32, Refusal> {
        self.bank.read(offset)
    }

    /// A store.
    ///
    /// # Errors
    /// An access that is not modelled.
    pub fn write(&mut self, now: Instant, offset: u32, value: u32) -> Result<(), Refusal> {
        match offset {
            KEYR => {
                self.keys = match (self.keys, value) {
                    (0, 0x4567_0123) => 1,
                    (1, 0xCDEF_89AB) => {
                        let control = self.bank.get(CR) & !LOCK;
                        self.bank.put(CR, control);
                        0
                    }
                    _ => 3,
                };
                Ok(())
            }
            SR => {
                let status = self.bank.get(SR) & !(value & 0xC3FB);
                self.bank.put(SR, status);
                Ok(())
            }
            CR => self.control(now, value),
            ACR => {
                let before = self.bank.write(ACR, value)?;
                // Section 3.7.1: a cache may be reset only while it is off.
                if value & DCRST != 0 && before & DCEN != 0 {
                    return told("the data cache was reset while it was on (FLASH_ACR.DCRST)");
                }
                if value & !before & DCEN != 0 && self.job.is_some() {
                    return told(
                        "the data cache was switched on while the flash memory was busy (errata ES0430, 2.2.2)",
                    );
                }
                Ok(())
            }
            ECCR => {
                let kept = self.bank.get(ECCR) & !(value & ECCD);
                self.bank.put(ECCR, kept);
                self.bank.write(ECCR, value & !(ECCD | 1 << 21)).map(|_| ())
            }
            _ => self.bank.write(offset, value).map(|_| ()),
        }
    }

    fn control(&mut self, now: Instant, value: u32) -> Result<(), Refusal> {
        let before = self.bank.get(CR);
        if before & LOCK != 0 {
            return if value & !before == 0 {
                Ok(())
            } else {
                told("FLASH_CR was written while locked")
            };
        }
        self.bank.write(CR, value)?;
        if value & LOCK != 0 {
            self.keys = 0;
        }
        if value & STRT != 0 && before & STRT == 0 {
            if value & PER == 0 {
                return told("only page erase is modelled, not mass erase");
            }
            if self.job.is_some() {
                return told("an erase was started while the flash memory was busy");
            }
            let page = value >> 3 & 0x7F;
            let second = value >> 11 & 1;
            let address = FLASH.start + second * BANK + page * PAGE;
            self.job = Some((now + ERASE, Job::Erase(address)));
            let status = self.bank.get(SR) | BSY;
            self.bank.put(SR, status);
        }
        Ok(())
    }
}
