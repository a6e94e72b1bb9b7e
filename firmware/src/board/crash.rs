//! Record of a failure of the program, kept in RAM that no start clears: the next start tells it in its health report.
//!
//! The record has a check word. Random RAM contents after power-off pass as a record once in 2³² times or less.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use cortex_m::peripheral::SCB;
use rig_shared::wire::message::{Crash, CrashKind};

/// Words of a record: kind, program counter, link register, CFSR, address, line, check word.
const WORDS: usize = 7;
/// CFSR.BFARVALID and CFSR.MMARVALID: BFAR, or MMFAR, holds the address of the fault (Armv7-M ARM, B3.2.15).
const BUS_ADDRESS_VALID: u32 = 1 << 15;
const MEMORY_ADDRESS_VALID: u32 = 1 << 7;
/// Words in an exception's frame, and the places of link register and program counter (Armv7-M ARM, B1.5.6).
const FRAME_WORDS: usize = 8;
const FRAME_LR: usize = 5;
const FRAME_PC: usize = 6;

/// Kinds in the order of their numbers, which begin at 1.
const KINDS: [CrashKind; 5] = [
    CrashKind::Panic,
    CrashKind::ProcessorFault,
    CrashKind::ClockStopped,
    CrashKind::FlashError,
    CrashKind::UnexpectedException,
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

/// Records a failure. `line` is that of a panic in its source file, or the number of an exception.
pub(crate) fn record(kind: CrashKind, [pc, lr]: [u32; 2], line: u32) {
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
    let mut words = [number, pc, lr, status, address, line, 0];
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

/// Returns the record of the failure before this start and clears it; `None` if there was none.
pub(crate) fn take() -> Option<Crash> {
    // As in `store`; any bits are valid words.
    #[allow(unsafe_code)]
    let words = unsafe { CRASH_STORE.0.get().cast::<[u32; WORDS]>().read_volatile() };
    store([0; WORDS]);
    let [number, pc, lr, status, address, line, checked] = words;
    if check(&words[..WORDS - 1]) != checked {
        return None;
    }
    let kind = KINDS.get(number.checked_sub(1)? as usize)?;
    Some(Crash {
        kind: *kind,
        pc,
        lr,
        status,
        address,
        line,
    })
}
