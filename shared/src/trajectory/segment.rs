//! The two segment shapes of staged trajectories.

use super::elapsed::Elapsed;
use super::reference::Reference;
use crate::scalar::Real;

/// Part of a trajectory, starting at the end of the previous one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<T> {
    /// Length, µs.
    pub(super) micros: u32,
    /// Position at its start, rad.
    pub(super) start: T,
    /// Motion of the segment.
    pub(super) shape: Shape<T>,
}

/// Motion of a segment.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape<T> {
    /// From rest to rest over a distance (rad), by a quintic with zero velocity and acceleration at its ends.
    Move(T),
    /// From one velocity to another (rad/s), 3s² − 2s³ between them; equal velocities cruise, two zeros dwell.
    Blend(T, T),
}

impl<T: Real<Mask = bool>> Segment<T> {
    /// Returns the reference `micros` and `fraction` after the start. Not inlined: the chip's linker finds it by name.
    #[inline(never)]
    pub(super) fn at(&self, micros: u32, fraction: T) -> Reference<T> {
        let f = T::from_f64;
        let span = Elapsed::seconds(self.micros.max(1), T::ZERO);
        let s = (T::from_u32(micros) + fraction) / T::from_u32(self.micros.max(1));
        match self.shape {
            Shape::Move(distance) => {
                let unit = quintic(s, span);
                Reference {
                    position: self.start + distance * unit.position,
                    velocity: distance * unit.velocity,
                    acceleration: distance * unit.acceleration,
                }
            }
            Shape::Blend(from, to) => {
                let change = to - from;
                Reference {
                    position: self.start
                        + span * (from * s + change * s.squared() * s * (T::ONE - f(0.5) * s)),
                    velocity: from + change * s.squared() * (f(3.0) - f(2.0) * s),
                    acceleration: change / span * f(6.0) * s * (T::ONE - s),
                }
            }
        }
    }

    /// Returns the points where position, velocity and acceleration can be extreme, as shares of the segment's length.
    pub(super) fn candidates(&self) -> [f64; 6] {
        // The quintic's acceleration peaks at ½ ∓ 1/√12, its velocity at ½. The blend's acceleration peaks at ½. A turn
        // between opposite equal velocities has its extreme position there too.
        let root = 0.28867513459481287;
        [0.0, 0.5 - root, 0.25, 0.5, 0.5 + root, 1.0]
    }
}

/// Returns 10s³ − 15s⁴ + 6s⁵ and its derivatives over a span in seconds.
#[inline(never)]
pub(super) fn quintic<T: Real>(s: T, span: T) -> Reference<T> {
    let f = T::from_f64;
    let rest = T::ONE - s;
    Reference {
        position: s.squared() * s * (f(10.0) - s * (f(15.0) - f(6.0) * s)),
        velocity: f(30.0) * (s * rest).squared() / span,
        acceleration: f(60.0) * s * rest * (T::ONE - s - s) / span.squared(),
    }
}

/// Returns the reference at a time, by a walk through the segments.
pub(super) fn at<T: Real<Mask = bool>>(
    segments: impl FnOnce(&mut dyn FnMut(Segment<T>) -> bool),
    time: Elapsed<T>,
) -> Reference<T> {
    let mut left = time.micros;
    let mut found = None;
    segments(&mut |segment| {
        if left >= u64::from(segment.micros) {
            left -= u64::from(segment.micros);
            return true;
        }
        found = Some(segment);
        false
    });
    // Evaluated in one place, because the machine code repeats the walk for every kind of segment. The remaining time
    // is below the segment's length, so it fits into 32 bits.
    found.map_or(Reference::rest(T::ZERO), |segment| {
        segment.at(left as u32, time.fraction)
    })
}
