//! Reference trajectories of one joint.
//!
//! Positions are offsets from the start position. Every kind begins and ends at rest. Position, velocity and
//! acceleration are continuous and consistent with each other.
//!
//! # Time
//! Every duration is a whole number of microseconds. The chip calls [`Trajectory::at_tick`] with its tick counter.
//! Whole periods and segments are subtracted in integers before any conversion to floating point: after days an `f32`
//! sees the same phase as in the first period. [`Trajectory::at`] takes seconds and is for the desktop; seconds in
//! `f32` would be 60 µs coarse after 20 minutes. Host (`f64`) and chip (`f32`) share all durations exactly.
//!
//! Leaves out: the joint's zero position and its limits; [`Trajectory::check`] gets them as arguments.

mod chirp;
mod fourier;
mod limits;
mod phase;
mod segment;
mod staged;

pub use chirp::{Chirp, Sweep};
pub use fourier::Fourier;
pub use limits::{Extremes, TrajectoryError};
pub use staged::{FrictionSweep, SlowReversals, Staircase};

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::scalar::{Real, Scalar};
use phase::Phase;
use segment::Segment;

/// Largest number of harmonics of a Fourier trajectory.
pub const HARMONICS: usize = 8;
/// Largest number of speeds of a friction sweep.
pub const SPEEDS: usize = 16;
/// Largest number of levels of a staircase.
pub const LEVELS: usize = 16;
/// Largest number of amplitudes of slow reversals.
pub const AMPLITUDES: usize = 8;

/// Microseconds in a second.
const MICROS: u64 = 1_000_000;

/// Position, velocity and acceleration of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference<T> {
    /// rad
    pub position: T,
    /// rad/s
    pub velocity: T,
    /// rad/s²
    pub acceleration: T,
}

impl<T: Real> Reference<T> {
    /// Returns a reference at rest at a position.
    fn rest(position: T) -> Self {
        Self {
            position,
            velocity: T::ZERO,
            acceleration: T::ZERO,
        }
    }

    /// Returns the reference multiplied by a number.
    fn scaled(self, share: T) -> Self {
        Self {
            position: share * self.position,
            velocity: share * self.velocity,
            acceleration: share * self.acceleration,
        }
    }

    /// Returns the motion multiplied by an envelope with its own first and second derivative (product rule).
    fn under(self, envelope: Self) -> Self {
        let two = T::from_f64(2.0);
        Self {
            position: envelope.position * self.position,
            velocity: envelope.velocity * self.position + envelope.position * self.velocity,
            acceleration: envelope.acceleration * self.position
                + two * envelope.velocity * self.velocity
                + envelope.position * self.acceleration,
        }
    }
}

/// A reference motion relative to its start position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(clippy::large_enum_variant)] // it crosses the wire whole; boxing needs an allocator
pub enum Trajectory<T> {
    /// Rest for a time, µs.
    Hold(u32),
    /// Periodic sum of harmonics: excitation for identification.
    Fourier(Fourier<T>),
    /// Swept sine.
    Chirp(Chirp<T>),
    /// Steps with dwell.
    Staircase(Staircase<T>),
    /// Slow triangles of several amplitudes: presliding, breakaway, backlash.
    SlowReversals(SlowReversals<T>),
    /// Pairs of constant speed: the friction map.
    FrictionSweep(FrictionSweep<T>),
}

/// A point in time: whole microseconds and a fraction.
#[derive(Clone, Copy, Debug)]
struct Elapsed<T> {
    micros: u64,
    /// Share of a microsecond, 0 to 1.
    fraction: T,
}

impl<T: Real> Elapsed<T> {
    fn from_tick(tick: u64, rate_hz: u32) -> Self {
        // With a period of whole microseconds, as on the rig, no 64-bit division is needed. The microcontroller has no
        // hardware for it.
        let (step, odd) = (
            MICROS as u32 / rate_hz.max(1),
            MICROS as u32 % rate_hz.max(1),
        );
        if odd == 0 {
            return Self {
                micros: tick.saturating_mul(u64::from(step)),
                fraction: T::ZERO,
            };
        }
        let rate = u64::from(rate_hz.max(1));
        let within = (tick % rate) * MICROS;
        // The rate fits into 32 bits, and so does its remainder.
        let rest = T::from_u32((within % rate) as u32) / T::from_u32(rate_hz.max(1));
        Self {
            micros: (tick / rate)
                .saturating_mul(MICROS)
                .saturating_add(within / rate),
            fraction: rest,
        }
    }

    /// Returns the time within a span, s. The microseconds of the span fit into 32 bits.
    fn seconds(micros: u32, fraction: T) -> T {
        (T::from_u32(micros) + fraction) * T::from_f64(1.0e-6)
    }
}

impl<T: Scalar> Trajectory<T> {
    /// Length, µs.
    pub fn duration_micros(&self) -> u64 {
        match self {
            Self::Hold(micros) => u64::from(*micros),
            Self::Fourier(motion) => motion.duration_micros(),
            Self::Chirp(motion) => motion.duration_micros(),
            Self::Staircase(motion) => motion.duration_micros(),
            Self::SlowReversals(motion) => motion.duration_micros(),
            Self::FrictionSweep(motion) => motion.duration_micros(),
        }
    }

    /// Length, s.
    pub fn duration(&self) -> T {
        T::from_f64(self.duration_micros() as f64 / MICROS as f64)
    }

    /// Returns the reference at a control tick; at rest before the start and after the end.
    pub fn at_tick(&self, tick: u64, rate_hz: u32) -> Reference<T> {
        self.at_elapsed(Elapsed::from_tick(tick, rate_hz))
    }

    /// Returns the reference at a time in seconds since the start. Precise for `f64`; for long runs in `f32` use
    /// [`at_tick`](Self::at_tick).
    pub fn at(&self, time: T) -> Reference<T> {
        let micros = time.to_f64() * MICROS as f64;
        // A cast from floating point saturates, and turns NaN into zero.
        let whole = micros as u64;
        let fraction = (micros - whole as f64).clamp_to(0.0, 1.0);
        self.at_elapsed(Elapsed {
            micros: whole,
            fraction: T::from_f64(fraction),
        })
    }

    fn at_elapsed(&self, time: Elapsed<T>) -> Reference<T> {
        self.at_phase(time, &self.phase())
    }

    /// Returns the phase constants of a sweep; for other kinds those of a constant phase.
    fn phase(&self) -> Phase<T> {
        match self {
            Self::Chirp(motion) => motion.phase(),
            _ => Phase::STILL,
        }
    }

    fn at_phase(&self, time: Elapsed<T>, phase: &Phase<T>) -> Reference<T> {
        if time.micros >= self.duration_micros() {
            return Reference::rest(T::ZERO);
        }
        self.within(time, phase)
    }

    /// Returns the reference before the end. Not inlined: the chip's linker finds it by name.
    #[inline(never)]
    fn within(&self, time: Elapsed<T>, phase: &Phase<T>) -> Reference<T> {
        match self {
            Self::Hold(_) => Reference::rest(T::ZERO),
            Self::Fourier(motion) => motion.at(time),
            Self::Chirp(motion) => motion.at(time, phase),
            Self::Staircase(motion) => segment::at(|visit| motion.segments(visit), time),
            Self::SlowReversals(motion) => motion.at(time),
            Self::FrictionSweep(motion) => motion.at(time),
        }
    }

    /// Calls `visit` with each segment in turn until it returns false.
    fn segments(&self, visit: &mut dyn FnMut(Segment<T>) -> bool) {
        match self {
            Self::Staircase(motion) => motion.segments(visit),
            Self::SlowReversals(motion) => motion.segments(visit),
            Self::FrictionSweep(motion) => motion.segments(visit),
            Self::Hold(_) | Self::Fourier(_) | Self::Chirp(_) => {}
        }
    }
}

/// Precomputed values of a trajectory. A control tick is too short to compute them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preparation<T> {
    phase: Phase<T>,
    duration_micros: u64,
}

impl<T: Scalar> Trajectory<T> {
    /// Computes the values that a [`Course`] needs: some thousand cycles of the microcontroller.
    pub fn prepare(&self) -> Preparation<T> {
        Preparation {
            phase: self.phase(),
            duration_micros: self.duration_micros(),
        }
    }
}

/// A trajectory ready for the control tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Course<T> {
    trajectory: Trajectory<T>,
    prepared: Preparation<T>,
}

impl<T: Scalar> Course<T> {
    /// Returns a trajectory with its preparation. The preparation must be of the same trajectory.
    pub fn new(trajectory: Trajectory<T>, prepared: Preparation<T>) -> Self {
        Self {
            trajectory,
            prepared,
        }
    }

    /// Length, µs.
    pub fn duration_micros(&self) -> u64 {
        self.prepared.duration_micros
    }

    /// Returns the reference at a control tick, as [`Trajectory::at_tick`] does.
    pub fn at_tick(&self, tick: u64, rate_hz: u32) -> Reference<T> {
        let time = Elapsed::from_tick(tick, rate_hz);
        if time.micros >= self.prepared.duration_micros {
            return Reference::rest(T::ZERO);
        }
        self.trajectory.within(time, &self.prepared.phase)
    }
}

macro_rules! convert {
    ($name:ident $from:ty => $to:ty, $doc:literal) => {
        impl Trajectory<$from> {
            #[doc = $doc]
            pub fn $name(&self) -> Trajectory<$to> {
                let to = |x: $from| x as $to;
                match self {
                    Self::Hold(micros) => Trajectory::Hold(*micros),
                    Self::Fourier(motion) => Trajectory::Fourier(motion.map(to)),
                    Self::Chirp(motion) => Trajectory::Chirp(motion.map(to)),
                    Self::Staircase(motion) => Trajectory::Staircase(motion.map(to)),
                    Self::SlowReversals(motion) => Trajectory::SlowReversals(motion.map(to)),
                    Self::FrictionSweep(motion) => Trajectory::FrictionSweep(motion.map(to)),
                }
            }
        }
    };
}

convert!(to_f32 f64 => f32, "The same trajectory as the rig runs it: values rounded, durations exact.");
convert!(to_f64 f32 => f64, "The rig's trajectory in double precision, exactly.");

#[cfg(test)]
mod tests;
