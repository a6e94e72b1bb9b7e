//! How warm the motor is, in RAM that no start clears: a reset does not cool a winding.
//!
//! Two places are written in turn, each with its complement, so that a reset in between leaves one whole. What RAM holds after
//! the power has been off passes as such by chance once in 2³¹ times, and is then a heat like another: the motor must cool.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// A place: the number's bits and their complement.
type Place = [u32; 2];

struct Kept(UnsafeCell<MaybeUninit<[Place; 2]>>);

// Before the control interrupt is enabled the start alone looks at it, and then that interrupt alone.
#[allow(unsafe_code)]
unsafe impl Sync for Kept {}

// Where `cortex-m-rt` puts nothing at the start.
#[allow(unsafe_code)]
#[unsafe(link_section = ".uninit.heat")]
static KEPT: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

fn word(place: usize, half: usize) -> *mut u32 {
    KEPT.0
        .get()
        .cast::<u32>()
        .wrapping_add(2 * (place & 1) + (half & 1))
}

/// Keeps the heat, A²; `tick` counts up.
#[inline(always)]
pub(crate) fn keep(tick: u64, heat: f32) {
    let place = tick as usize & 1;
    // Within the static, aligned; volatile, as the next reader is the next start.
    #[allow(unsafe_code)]
    unsafe {
        word(place, 0).write_volatile(heat.to_bits());
        word(place, 1).write_volatile(!heat.to_bits());
    }
}

/// The heat that was kept, A²; none where nothing whole is found.
pub(crate) fn kept() -> Option<f32> {
    let read = |place| {
        // As above; any bits are a number.
        #[allow(unsafe_code)]
        let [bits, check] = [0, 1].map(|half| unsafe { word(place, half).read_volatile() });
        (bits == !check).then(|| f32::from_bits(bits))
    };
    let [one, two] = [read(0), read(1)].map(|heat| heat.filter(|heat| *heat >= 0.0));
    match (one, two) {
        (Some(one), Some(two)) => Some(one.max(two)),
        (one, two) => one.or(two),
    }
}
