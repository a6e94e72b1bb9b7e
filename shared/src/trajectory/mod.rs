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
mod elapsed;
mod error;
mod extremes;
mod fourier;
mod limits;
mod phase;
mod reference;
mod segment;
mod staged;
mod sweep;

pub use chirp::Chirp;
pub use error::TrajectoryError;
pub use extremes::Extremes;
pub use fourier::{Fourier, HARMONICS};
pub use reference::Reference;
pub use staged::{AMPLITUDES, FrictionSweep, LEVELS, SPEEDS, SlowReversals, Staircase};
pub use sweep::Sweep;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::scalar::{Real, Scalar};
use elapsed::{Elapsed, MICROS};
use phase::Phase;
use segment::Segment;

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
pub struct TrajectoryConstants<T> {
    phase: Phase<T>,
    duration_micros: u64,
}

impl<T: Scalar> Trajectory<T> {
    /// Computes the values that a [`PreparedTrajectory`] needs: some thousand cycles of the microcontroller.
    pub fn prepare(&self) -> TrajectoryConstants<T> {
        TrajectoryConstants {
            phase: self.phase(),
            duration_micros: self.duration_micros(),
        }
    }
}

/// A trajectory ready for the control tick.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedTrajectory<T> {
    trajectory: Trajectory<T>,
    prepared: TrajectoryConstants<T>,
}

impl<T: Scalar> PreparedTrajectory<T> {
    /// Returns a trajectory with its preparation. The preparation must be of the same trajectory.
    pub fn new(trajectory: Trajectory<T>, prepared: TrajectoryConstants<T>) -> Self {
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
