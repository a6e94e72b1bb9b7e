//! Record of a failure of the program, kept in RAM that no start clears: the next start tells it in its health report.
//!
//! The record has a check word. Random RAM contents after power-off pass as a record once in 2³² times or less.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use cortex_m::peripheral::SCB;
use rig_shared::wire::message::{Crash, CrashKind, FILE_BYTES, ResetCause};

/// Words of a record: kind, program counter, link register, CFSR, address, line, silent parts, source file, check word.
const WORDS: usize = FILE + FILE_WORDS + 1;
/// Place of the source file's path in a record.
const FILE: usize = 7;
const FILE_WORDS: usize = FILE_BYTES / 4;
/// CFSR.BFARVALID and CFSR.MMARVALID: BFAR, or MMFAR, holds the address of the fault (Armv7-M ARM, B3.2.15).
const BUS_ADDRESS_VALID: u32 = 1 << 15;
const MEMORY_ADDRESS_VALID: u32 = 1 << 7;
/// Words in an exception's frame, and the places of link register and program counter (Armv7-M ARM, B1.5.6).
const FRAME_WORDS: usize = 8;
const FRAME_LR: usize = 5;
const FRAME_PC: usize = 6;

/// Kinds in the order of their numbers, which begin at 1.
const KINDS: [CrashKind; 7] = [
    CrashKind::Panic,
    CrashKind::ProcessorFault,
    CrashKind::ClockStopped,
    CrashKind::FlashError,
    CrashKind::UnexpectedException,
    CrashKind::Watchdog,
    CrashKind::TickStopped,
];

// Symbols of memory.x; only their addresses are used.
#[allow(unsafe_code)]
unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

struct CrashStore(UnsafeCell<MaybeUninit<[u32; WORDS]>>);

// Only the start uses it, before any interrupt is enabled, and a handler that never returns, after it has disabled them.
#[allow(unsafe_code)]
unsafe impl Sync for CrashStore {}

// `cortex-m-rt` does not initialise this section.
#[allow(unsafe_code)]
#[unsafe(link_section = ".uninit.crash")]
static CRASH_STORE: CrashStore = CrashStore(UnsafeCell::new(MaybeUninit::uninit()));

/// Returns the check word of the words before it.
fn check(words: &[u32]) -> u32 {
    words
        .iter()
        .fold(0x5A17_C0DE, |sum: u32, word| sum.rotate_left(5) ^ word)
}

fn store(words: [u32; WORDS]) {
    // Its own static; volatile, because the next reader is the next start.
    #[allow(unsafe_code)]
    unsafe {
        CRASH_STORE
            .0
            .get()
            .cast::<[u32; WORDS]>()
            .write_volatile(words);
    }
}

/// What is known of a failure, beside the processor's own registers.
#[derive(Clone, Copy, Default)]
pub(crate) struct Failure<'a> {
    /// Program counter and link register; zeros if they are unknown.
    pub(crate) place: [u32; 2],
    /// Line of a panic in its source file, or the number of an exception.
    pub(crate) line: u32,
    /// Path of a panic's source file.
    pub(crate) file: &'a str,
    /// Parts that did not report to the watchdog, one bit each.
    pub(crate) silent: u8,
}

/// Returns the last bytes of a path as words, filled up with zeros. A character that does not fit whole is left out.
fn last_words(path: &str) -> [u32; FILE_WORDS] {
    let mut start = path.len().saturating_sub(FILE_BYTES);
    while !path.is_char_boundary(start) {
        start += 1;
    }
    let mut words = [0; FILE_WORDS];
    for (place, byte) in path.bytes().skip(start).enumerate() {
        if let Some(word) = words.get_mut(place / 4) {
            *word |= u32::from(byte) << (8 * (place % 4));
        }
    }
    words
}

/// Records a failure.
pub(crate) fn record(kind: CrashKind, failure: Failure<'_>) {
    let [pc, lr] = failure.place;
    // Reading these registers has no side effect.
    #[allow(unsafe_code)]
    let block = unsafe { &*SCB::PTR };
    let status = block.cfsr.read();
    let address = if status & BUS_ADDRESS_VALID != 0 {
        block.bfar.read()
    } else if status & MEMORY_ADDRESS_VALID != 0 {
        block.mmfar.read()
    } else {
        0
    };
    let number = KINDS.iter().position(|known| *known == kind);
    let number = number.map_or(0, |place| place as u32 + 1);
    let mut words = [0; WORDS];
    let silent = u32::from(failure.silent);
    words[..FILE].copy_from_slice(&[number, pc, lr, status, address, failure.line, silent]);
    words[FILE..WORDS - 1].copy_from_slice(&last_words(failure.file));
    words[WORDS - 1] = check(&words[..WORDS - 1]);
    store(words);
}

/// Returns program counter and link register from the frame of an exception; zeros if the frame is not on the stack.
pub(crate) fn from_frame(frame: *const u32) -> [u32; 2] {
    let stack = &raw const _stack_end as usize..=&raw const _stack_start as usize;
    let at = frame as usize;
    if !frame.is_aligned() || !stack.contains(&at) || !stack.contains(&(at + 4 * FRAME_WORDS)) {
        return [0; 2];
    }
    // The whole frame is on the stack.
    #[allow(unsafe_code)]
    [FRAME_PC, FRAME_LR].map(|place| unsafe { frame.add(place).read_volatile() })
}

/// Forgets the record.
pub(crate) fn clear() {
    store([0; WORDS]);
}

/// Returns the failure before this start and forgets its record; `None` if there was none.
///
/// The watchdog's reset comes without notice. The task that feeds it records the silent parts before; if it could not, the
/// reset itself is the record.
pub(crate) fn take(reset: ResetCause) -> Option<Crash> {
    // As in `store`; any bits are valid words.
    #[allow(unsafe_code)]
    let words = unsafe { CRASH_STORE.0.get().cast::<[u32; WORDS]>().read_volatile() };
    clear();
    let bitten = reset == ResetCause::Watchdog;
    let unknown = bitten.then_some(Crash {
        kind: CrashKind::Watchdog,
        pc: 0,
        lr: 0,
        status: 0,
        address: 0,
        line: 0,
        file: [0; FILE_BYTES],
        silent: 0,
    });
    let noted = noted(&words).filter(|crash| bitten == (crash.kind == CrashKind::Watchdog));
    noted.or(unknown)
}

/// Returns the failure that a record tells; `None` if it is not whole.
fn noted(words: &[u32; WORDS]) -> Option<Crash> {
    let (checked, content) = words.split_last()?;
    if check(content) != *checked {
        return None;
    }
    let [number, pc, lr, status, address, line, silent] = *content.first_chunk()?;
    let kind = KINDS.get(number.checked_sub(1)? as usize)?;
    let mut file = [0; FILE_BYTES];
    for (bytes, word) in file.chunks_exact_mut(4).zip(content.iter().skip(FILE)) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    Some(Crash {
        kind: *kind,
        pc,
        lr,
        status,
        address,
        line,
        file,
        silent: silent as u8,
    })
}
