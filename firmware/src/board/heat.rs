//! Motor heat, kept in RAM that no start clears: a reset does not cool a winding.
//!
//! Two slots are written in turn, each with its complement, so one stays valid if a reset comes in between. After
//! power-off, random RAM contents pass as valid once in 2³¹ times, and are then treated like any other heat.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// One slot: the bits of the number and their complement.
type Slot = [u32; 2];

struct HeatStore(UnsafeCell<MaybeUninit<[Slot; 2]>>);

// Only the start uses it before the control interrupt is enabled, and afterwards only that interrupt.
#[allow(unsafe_code)]
unsafe impl Sync for HeatStore {}

// `cortex-m-rt` does not initialise this section.
#[allow(unsafe_code)]
#[unsafe(link_section = ".uninit.heat")]
static HEAT_STORE: HeatStore = HeatStore(UnsafeCell::new(MaybeUninit::uninit()));

fn word(slot: usize, half: usize) -> *mut u32 {
    HEAT_STORE
        .0
        .get()
        .cast::<u32>()
        .wrapping_add(2 * (slot & 1) + (half & 1))
}

/// Stores the heat, A²; `count` counts the stores.
#[inline(always)]
pub(crate) fn store(count: u32, heat: f32) {
    let slot = count as usize & 1;
    // Within the static, aligned; volatile, because the next reader is the next start.
    #[allow(unsafe_code)]
    unsafe {
        word(slot, 0).write_volatile(heat.to_bits());
        word(slot, 1).write_volatile(!heat.to_bits());
    }
}

/// Returns the stored heat, A²; `None` if no slot is valid.
pub(crate) fn load() -> Option<f32> {
    let read = |slot| {
        // As above; any bits are a valid number.
        #[allow(unsafe_code)]
        let [bits, check] = [0, 1].map(|half| unsafe { word(slot, half).read_volatile() });
        (bits == !check).then(|| f32::from_bits(bits))
    };
    let [one, two] = [read(0), read(1)].map(|heat| heat.filter(|heat| *heat >= 0.0));
    match (one, two) {
        (Some(one), Some(two)) => Some(one.max(two)),
        (one, two) => one.or(two),
    }
}
