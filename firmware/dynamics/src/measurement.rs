//! Results and cycles in RAM.

use core::hint::black_box;
use core::sync::atomic::{AtomicU32, Ordering};

use rig_dynamics::{Arm, JOINTS, STATES, states};

use crate::clock::Cycles;

/// Functions that are measured.
const FUNCTIONS: usize = 4;
/// Words of a state: results of the functions as bits of f32, then their cycles.
const WORDS: usize = FUNCTIONS * (JOINTS + 1);
/// The word behind all states if everything was computed.
const COMPLETE: u32 = 0x1DEA_5EED;

/// The words of every state in order, then [`COMPLETE`].
#[used]
static RESULTS: [AtomicU32; STATES * WORDS + 1] = [const { AtomicU32::new(0) }; STATES * WORDS + 1];

fn note(place: usize, word: u32) {
    if let Some(entry) = RESULTS.get(place) {
        entry.store(word, Ordering::Relaxed);
    }
}

/// Runs a function and returns its result with the cycles that it took, without those of the counter itself.
#[inline(never)]
fn measured<T>(cycles: &Cycles, function: impl FnOnce() -> T) -> (T, u32) {
    let empty = cycles.now();
    let begun = cycles.now();
    let result = black_box(function());
    let ended = cycles.now();
    let counter = begun.wrapping_sub(empty);
    (result, ended.wrapping_sub(begun).saturating_sub(counter))
}

/// Computes everything and notes it. Leaves the mark of completion out if a function fails.
pub(crate) fn run(cycles: &Cycles) {
    let Ok(arm) = Arm::<f32>::irp6() else {
        return;
    };
    for (number, state) in states().enumerate() {
        let state = black_box(state);
        let (q, qd, qdd) = (&state.q, &state.qd, &state.qdd);
        let (motor, first) = measured(cycles, || arm.motor_torque(q, qd, qdd));
        let Ok(motor) = motor else { return };
        let (found, second) = measured(cycles, || arm.acceleration(q, qd, &motor));
        let Ok(found) = found else { return };
        let (joint, third) = measured(cycles, || arm.joint_torque(q, qd, qdd));
        let Ok(joint) = joint else { return };
        let (free, fourth) = measured(cycles, || arm.articulated(q, qd, &joint));
        let Ok(free) = free else { return };
        let mut place = number * WORDS;
        for (values, count) in [
            (motor, first),
            (found, second),
            (joint, third),
            (free, fourth),
        ] {
            for value in values {
                note(place, value.to_bits());
                place += 1;
            }
            note(place, count);
            place += 1;
        }
    }
    note(STATES * WORDS, COMPLETE);
}
