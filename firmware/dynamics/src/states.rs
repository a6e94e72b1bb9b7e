//! States of the joints, the same on desktop and controller.

use crate::irp6::{JOINTS, RANGES};

/// Number of states.
pub const STATES: usize = 32;
/// Share of each position range that the states cover: no drive is singular there.
const SHARE: f32 = 0.5;

/// Positions, velocities and accelerations of the joints, and torques of the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// rad
    pub q: [f32; JOINTS],
    /// rad/s
    pub qd: [f32; JOINTS],
    /// rad/s²
    pub qdd: [f32; JOINTS],
}

/// Returns the states: positions within the middle half of the ranges, speeds to 2 rad/s, accelerations to 6 rad/s².
pub fn states() -> impl Iterator<Item = State> {
    let mut seed = 1_u32;
    (0..STATES).map(move |_| {
        // A linear congruential generator (Press et al. 1992, "An even quicker generator"), its upper 16 bits.
        let mut draw = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 16) as f32 / 32_768.0 - 1.0
        };
        State {
            q: RANGES.map(|[low, high]| 0.5 * (low + high) + 0.5 * SHARE * (high - low) * draw()),
            qd: [(); JOINTS].map(|()| 2.0 * draw()),
            qdd: [(); JOINTS].map(|()| 6.0 * draw()),
        }
    })
}
