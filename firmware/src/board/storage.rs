//! Settings in the last two pages of flash bank 2. The program runs from bank 1, which can be read meanwhile.
//!
//! Registers and sequences: RM0440, embedded flash memory, "Erase and program operations" (page erase, standard
//! programming of 64-bit words).

use embassy_stm32::pac::FLASH;
use embassy_stm32::pac::flash::regs::Sr;
use embassy_time::{Duration, Instant, Timer};
use rig_firmware::config::{Config, Settings};
use rig_firmware::settings_storage::{self, MAX_COPY_BYTES, Selection, StoredCopy};

/// Page size with two banks, bytes.
const PAGE: usize = 2048;
/// Pages of a bank.
const PAGES: u8 = 128;
/// Longest wait for the flash. Erasing a page takes at most 25 ms, a word 0.13 ms (DS12288, "Flash memory
/// characteristics").
const TIMEOUT: Duration = Duration::from_millis(100);

// Symbols of memory.x; only their addresses are used.
#[allow(unsafe_code)]
unsafe extern "C" {
    static _store_start: u32;
}

/// The flash as storage.
pub(crate) struct Storage {
    /// The slot to write next, and its number.
    slot: usize,
    number: u32,
}

/// The flash did not carry out an operation.
pub(crate) struct FlashError;

/// Address of a slot.
fn address(slot: usize) -> *mut u32 {
    let start = (&raw const _store_start).cast_mut();
    start.wrapping_byte_add(slot * PAGE)
}

fn read_copy(slot: usize) -> StoredCopy {
    let mut bytes = [0; MAX_COPY_BYTES];
    for (word, chunk) in bytes.chunks_exact_mut(4).enumerate() {
        // Inside the page, aligned; volatile, because the compiler does not see changes of the flash. A word that
        // cannot be corrected ends in `fault::NonMaskableInt`, which allows it to be read unchanged.
        #[allow(unsafe_code)]
        let value = unsafe { address(slot).wrapping_add(word).read_volatile() };
        chunk.copy_from_slice(&value.to_le_bytes());
    }
    settings_storage::decode(&bytes)
}

impl Storage {
    /// Reads the stored settings.
    pub(crate) fn open(config: &Config) -> (Self, Selection) {
        let selection = settings_storage::select(config, [read_copy(0), read_copy(1)]);
        let storage = Self {
            slot: selection.slot,
            number: selection.number,
        };
        (storage, selection)
    }

    /// Stores settings over the older copy, and reads them back.
    pub(crate) async fn store(&mut self, settings: &Settings) -> Result<(), FlashError> {
        // With one bank, pages are twice as large, and writing would stall the control tick.
        if !FLASH.optr().read().dbank() {
            return Err(FlashError);
        }
        // Unchanged settings are skipped: a page endures ten thousand erasures (DS12288, "Flash memory endurance").
        // They are written if the other slot is damaged, because there would be no second copy.
        if matches!(read_copy(1 - self.slot), StoredCopy::Valid { number, settings: stored }
            if number.wrapping_add(1) == self.number && stored == *settings)
            && read_copy(self.slot) != StoredCopy::Damaged
        {
            return Ok(());
        }
        let bytes = settings_storage::encode(settings, self.number).ok_or(FlashError)?;
        unlock();
        let result = self.write(&bytes).await;
        FLASH.cr().modify(|w| w.set_lock(true));
        result?;
        let expected = StoredCopy::Valid {
            number: self.number,
            settings: *settings,
        };
        if read_copy(self.slot) != expected {
            return Err(FlashError);
        }
        self.slot = 1 - self.slot;
        self.number = self.number.wrapping_add(1);
        Ok(())
    }

    /// Erases the page of the present slot and writes the bytes.
    ///
    /// The data cache is off meanwhile: reads of bank 1 while bank 2 is being programmed may corrupt it (errata ES0430,
    /// 2.2.2, "Data cache might be corrupted during Flash memory read-while-write operation").
    async fn write(&self, bytes: &[u8]) -> Result<(), FlashError> {
        wait_ready().await?;
        set_data_cache(false);
        let result = self.erase_and_program(bytes).await;
        // An operation that did not end in time may still run: then the cache stays off until the next reset.
        if !FLASH.sr().read().bsy() {
            set_data_cache(true);
        }
        result
    }

    async fn erase_and_program(&self, bytes: &[u8]) -> Result<(), FlashError> {
        clear_errors();
        FLASH.cr().modify(|w| {
            w.set_per(true);
            w.set_bker(true);
            w.set_pnb(PAGES - 2 + self.slot as u8);
        });
        FLASH.cr().modify(|w| w.set_strt(true));
        let erased = wait_ready().await;
        FLASH.cr().modify(|w| {
            w.set_per(false);
            w.set_bker(false);
        });
        erased?;
        for (index, word) in bytes.chunks_exact(8).enumerate() {
            FLASH.cr().modify(|w| w.set_pg(true));
            for (half, chunk) in word.chunks_exact(4).enumerate() {
                let value = chunk
                    .iter()
                    .rev()
                    .fold(0, |sum, &byte| sum << 8 | u32::from(byte));
                // Inside the page just erased: an image is shorter than a page.
                #[allow(unsafe_code)]
                unsafe {
                    address(self.slot)
                        .wrapping_add(2 * index + half)
                        .write_volatile(value);
                }
            }
            let written = wait_ready().await;
            FLASH.cr().modify(|w| w.set_pg(false));
            written?;
        }
        Ok(())
    }
}

/// Switches the data cache on, emptied, or off. Earlier readings must not come from it again.
fn set_data_cache(on: bool) {
    FLASH.acr().modify(|w| w.set_dcen(false));
    if on {
        FLASH.acr().modify(|w| w.set_dcrst(true));
        FLASH.acr().modify(|w| w.set_dcrst(false));
        FLASH.acr().modify(|w| w.set_dcen(true));
    }
}

fn unlock() {
    if FLASH.cr().read().lock() {
        FLASH.keyr().write_value(0x4567_0123);
        FLASH.keyr().write_value(0xcdef_89ab);
    }
}

/// Writing one clears an error flag.
fn clear_errors() {
    FLASH.sr().write_value(Sr(ERRORS | 1));
}

/// OPERR, PROGERR, WRPERR, PGAERR, SIZERR, PGSERR, MISERR, FASTERR.
const ERRORS: u32 = 0x3fa;

/// Waits for the flash without blocking other tasks.
async fn wait_ready() -> Result<(), FlashError> {
    let start = Instant::now();
    while FLASH.sr().read().bsy() {
        if start.elapsed() > TIMEOUT {
            return Err(FlashError);
        }
        Timer::after_micros(200).await;
    }
    if FLASH.sr().read().0 & ERRORS == 0 {
        Ok(())
    } else {
        Err(FlashError)
    }
}
