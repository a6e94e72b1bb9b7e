//! Trajectories of stages: staircase, slow reversals, friction sweep.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::elapsed::Elapsed;
use super::reference::Reference;
use super::segment::{self, Segment, Shape};
use crate::scalar::{Real, Scalar};

/// Largest number of speeds of a friction sweep.
pub const SPEEDS: usize = 16;
/// Largest number of levels of a staircase.
pub const LEVELS: usize = 16;
/// Largest number of amplitudes of slow reversals.
pub const AMPLITUDES: usize = 8;

/// Moves by quintics to each level in turn, then back to the start, with a dwell after each move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Staircase<T> {
    /// Levels, rad from the start.
    pub levels: Vec<T, LEVELS>,
    /// Length of a move, µs.
    pub move_us: u32,
    /// Dwell after a move, µs.
    pub dwell_us: u32,
}

/// Triangles at constant slow speed with smooth turns about the start, with several amplitudes one after the other.
///
/// Times are stored instead of distances so that host and chip agree to the microsecond. [`SlowReversals::new`]
/// computes the times, [`SlowReversals::amplitude`] returns the distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SlowReversals<T> {
    /// Speed between the turns, rad/s.
    pub speed: T,
    /// Half the length of a turn from one direction to the other, µs; also half of starting and stopping.
    pub half_turn_us: u32,
    /// For each amplitude the time from the centre to the start of the turn, µs; at least `half_turn_us`.
    pub quarter_us: Vec<u32, AMPLITUDES>,
    /// Full triangles per amplitude.
    pub cycles: u16,
}

/// For each speed one pass forth and one back across the same interval, each from rest to rest.
///
/// The interval is centred on the start. All passes run between the same ends, so that the constant-speed part covers
/// at least the stated travel for every speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct FrictionSweep<T> {
    /// Half the distance between the ends, rad.
    pub half_span: T,
    /// Time at constant speed of each pass, µs; the speed follows from it, see [`FrictionSweep::speed`].
    pub cruise_us: Vec<u32, SPEEDS>,
    /// Time to reach the speed, and to stop, µs.
    pub ramp_us: u32,
    /// Dwell after each pass, µs.
    pub dwell_us: u32,
    /// Time of the move from the start to the first end, and of the final move back, µs.
    pub lead_us: u32,
}

/// Returns the whole microseconds of a time in seconds; none if it is NaN, below 1 µs or beyond 32 bits.
fn micros(seconds: f64) -> Option<u32> {
    let micros = libm::round(seconds * 1.0e6);
    (micros >= 1.0 && micros <= f64::from(u32::MAX)).then_some(micros as u32)
}

/// Returns a quotient, in 32 bits if they suffice, because the microcontroller divides them in hardware.
fn divide(number: u64, by: u64) -> u64 {
    match (u32::try_from(number), u32::try_from(by)) {
        (Ok(number), Ok(by)) => u64::from(number / by.max(1)),
        _ => number / by.max(1),
    }
}

fn dwell<T: Real>(start: T, micros: u32) -> Segment<T> {
    Segment {
        micros,
        start,
        shape: Shape::Blend(T::ZERO, T::ZERO),
    }
}

impl<T: Real<Mask = bool>> Staircase<T> {
    pub(super) fn duration_micros(&self) -> u64 {
        (self.levels.len() as u64 + 1) * (u64::from(self.move_us) + u64::from(self.dwell_us))
    }

    pub(super) fn map<U>(&self, f: impl Fn(T) -> U) -> Staircase<U> {
        Staircase {
            levels: self.levels.iter().map(|x| f(*x)).collect(),
            move_us: self.move_us,
            dwell_us: self.dwell_us,
        }
    }

    pub(super) fn segments(&self, visit: &mut dyn FnMut(Segment<T>) -> bool) {
        let mut start = T::ZERO;
        for level in self.levels.iter().copied().chain([T::ZERO]) {
            let shape = Shape::Move(level - start);
            if !visit(Segment {
                micros: self.move_us,
                start,
                shape,
            }) || !visit(dwell(level, self.dwell_us))
            {
                return;
            }
            start = level;
        }
    }
}

impl<T: Scalar> SlowReversals<T> {
    /// Returns reversals at a speed (rad/s) with turns of `turn` seconds over amplitudes in rad.
    ///
    /// None if speed, turn or an amplitude is not above zero, an amplitude is too small for its turn, there are more
    /// than [`AMPLITUDES`], or a time exceeds 71 minutes.
    pub fn new(speed: T, turn: T, amplitudes: &[T], cycles: u16) -> Option<Self> {
        let half_turn_us = micros(0.5 * turn.to_f64())?;
        let mut quarter_us = Vec::new();
        for amplitude in amplitudes {
            let straight =
                amplitude.to_f64() / speed.to_f64() - OVERSHOOT * 2e-6 * f64::from(half_turn_us);
            let quarter = micros(straight).filter(|t| *t >= half_turn_us)?;
            quarter_us.push(quarter).ok()?;
        }
        let positive = T::ZERO.lt(speed);
        positive.then_some(Self {
            speed,
            half_turn_us,
            quarter_us,
            cycles,
        })
    }

    /// Returns the distance from the centre to the outermost point of the triangle with that index, rad.
    pub fn amplitude(&self, index: usize) -> Option<T> {
        let quarter = *self.quarter_us.get(index)?;
        let overshoot = T::from_f64(2.0 * OVERSHOOT) * Elapsed::seconds(self.half_turn_us, T::ZERO);
        Some(self.speed * (Elapsed::seconds(quarter, T::ZERO) + overshoot))
    }
}

/// Travel of a turn beyond its start, in speed times length of the turn: ½ − 2·(⅛ − 1/32).
const OVERSHOOT: f64 = 0.3125;

impl<T: Real<Mask = bool>> SlowReversals<T> {
    /// Returns the length of a full turn, in whole microseconds within 32 bits.
    fn turn_us(&self) -> u32 {
        self.half_turn_us.saturating_mul(2)
    }

    pub(super) fn amplitude_micros(&self, quarter: u32) -> u64 {
        let straight = 2 * u64::from(quarter);
        let cycles = u64::from(self.cycles);
        let turn = u64::from(self.turn_us());
        let lead = turn + u64::from(quarter.saturating_sub(self.half_turn_us));
        2 * lead + 2 * cycles * turn + (2 * cycles).saturating_sub(1) * straight
    }

    pub(super) fn duration_micros(&self) -> u64 {
        if self.cycles == 0 {
            return 0;
        }
        self.quarter_us
            .iter()
            .map(|quarter| self.amplitude_micros(*quarter))
            .sum()
    }

    pub(super) fn map<U>(&self, f: impl Fn(T) -> U) -> SlowReversals<U> {
        SlowReversals {
            speed: f(self.speed),
            half_turn_us: self.half_turn_us,
            quarter_us: self.quarter_us.clone(),
            cycles: self.cycles,
        }
    }

    pub(super) fn segments(&self, visit: &mut dyn FnMut(Segment<T>) -> bool) {
        for quarter in self.quarter_us.iter().copied().filter(|_| self.cycles > 0) {
            if !self.triangles(quarter, 0, visit) {
                return;
            }
        }
    }

    /// Returns the reference at a time. Whole amplitudes and triangles are subtracted first, so that the time of a tick
    /// does not grow with their number. Not inlined: the chip's linker finds it by name.
    #[inline(never)]
    pub(super) fn at(&self, time: Elapsed<T>) -> Reference<T> {
        let mut left = time.micros;
        for quarter in self.quarter_us.iter().copied() {
            let length = self.amplitude_micros(quarter);
            if left >= length {
                left -= length;
                continue;
            }
            let lead =
                u64::from(self.turn_us()) + u64::from(quarter.saturating_sub(self.half_turn_us));
            let cycle = 2 * u64::from(self.turn_us()) + 4 * u64::from(quarter);
            let mut done = 0;
            if left >= lead && self.cycles > 0 {
                // At most the number of cycles, so it fits into 16 bits.
                let whole = divide(left - lead, cycle.max(1)).min(u64::from(self.cycles) - 1);
                left -= lead + whole * cycle;
                done = whole as u16 + 1;
            }
            let time = Elapsed {
                micros: left,
                ..time
            };
            return segment::at(
                |visit| {
                    let _ = self.triangles(quarter, done, visit);
                },
                time,
            );
        }
        Reference::rest(T::ZERO)
    }

    /// Visits the segments of one amplitude from cycle `first` on. Cycles count from 1; 0 also includes the start.
    pub(super) fn triangles(
        &self,
        quarter: u32,
        first: u16,
        visit: &mut dyn FnMut(Segment<T>) -> bool,
    ) -> bool {
        let (v, turn_us) = (self.speed, self.turn_us());
        // Starting and stopping take a full turn's time and cover half of it at speed.
        let start_distance = v * Elapsed::seconds(self.half_turn_us, T::ZERO);
        let edge = v * Elapsed::seconds(quarter, T::ZERO);
        let short = quarter.saturating_sub(self.half_turn_us);
        let straight = quarter.saturating_mul(2);
        let mut visit_blend = |micros: u32, start: T, from: T, to: T| {
            visit(Segment {
                micros,
                start,
                shape: Shape::Blend(from, to),
            })
        };
        if first == 0
            && !(visit_blend(turn_us, T::ZERO, T::ZERO, v)
                && visit_blend(short, start_distance, v, v))
        {
            return false;
        }
        for cycle in first.max(1)..=self.cycles {
            let last = cycle == self.cycles;
            let on = visit_blend(turn_us, edge, v, -v)
                && visit_blend(straight, edge, -v, -v)
                && visit_blend(turn_us, -edge, -v, v)
                && visit_blend(if last { short } else { straight }, -edge, v, v);
            if !on {
                return false;
            }
        }
        visit_blend(turn_us, -start_distance, v, T::ZERO)
    }
}

impl<T: Scalar> FrictionSweep<T> {
    /// Returns a sweep over speeds (rad/s). Each speed holds for at least `travel` (rad) and is reached within `ramp`
    /// seconds. Each pass ends with a dwell of `dwell` seconds, and the move to the first end takes `lead` seconds.
    ///
    /// None if a value is not above zero, there are more than [`SPEEDS`], or a time exceeds 71 minutes.
    pub fn new(speeds: &[T], travel: T, ramp: T, dwell: T, lead: T) -> Option<Self> {
        let fastest = speeds.iter().fold(0.0, |most: f64, v| most.max(v.to_f64()));
        let ramp_us = micros(ramp.to_f64())?;
        let ramp_s = f64::from(ramp_us) * 1.0e-6;
        // The fastest pass needs the longest run-up.
        let span = travel.to_f64() + fastest * ramp_s;
        if travel.le(T::ZERO) {
            return None;
        }
        let mut cruise_us = Vec::new();
        for speed in speeds {
            cruise_us
                .push(micros(span / speed.to_f64() - ramp_s)?)
                .ok()?;
        }
        Some(Self {
            half_span: T::from_f64(0.5 * span),
            cruise_us,
            ramp_us,
            dwell_us: micros(dwell.to_f64())?,
            lead_us: micros(lead.to_f64())?,
        })
    }
}

impl<T: Real<Mask = bool>> FrictionSweep<T> {
    /// Returns the constant speed of the pair of passes with that index, rad/s.
    pub fn speed(&self, index: usize) -> Option<T> {
        Some(self.speed_of(*self.cruise_us.get(index)?))
    }

    fn speed_of(&self, cruise: u32) -> T {
        // Both ramps together cover the distance of one ramp's time at speed.
        let time = cruise.saturating_add(self.ramp_us).max(1);
        (self.half_span + self.half_span) / Elapsed::seconds(time, T::ZERO)
    }

    pub(super) fn duration_micros(&self) -> u64 {
        let passes: u64 = self
            .cruise_us
            .iter()
            .map(|cruise| {
                2 * (u64::from(*cruise) + 2 * u64::from(self.ramp_us) + u64::from(self.dwell_us))
            })
            .sum();
        passes + 2 * u64::from(self.lead_us)
    }

    pub(super) fn map<U>(&self, f: impl Fn(T) -> U) -> FrictionSweep<U> {
        FrictionSweep {
            half_span: f(self.half_span),
            cruise_us: self.cruise_us.clone(),
            ramp_us: self.ramp_us,
            dwell_us: self.dwell_us,
            lead_us: self.lead_us,
        }
    }

    /// Returns the reference at a time. Not inlined: the chip's linker finds it by name.
    #[inline(never)]
    pub(super) fn at(&self, time: Elapsed<T>) -> Reference<T> {
        segment::at(|visit| self.segments(visit), time)
    }

    #[inline(always)]
    pub(super) fn segments(&self, visit: &mut dyn FnMut(Segment<T>) -> bool) {
        let end = self.half_span;
        if !visit(Segment {
            micros: self.lead_us,
            start: T::ZERO,
            shape: Shape::Move(-end),
        }) {
            return;
        }
        for cruise in self.cruise_us.iter().copied() {
            for side in [-T::ONE, T::ONE] {
                let v = -side * self.speed_of(cruise);
                let start = side * end;
                let run_up = T::from_f64(0.5) * v * Elapsed::seconds(self.ramp_us, T::ZERO);
                let mut visit_blend = |micros: u32, start: T, from: T, to: T| {
                    visit(Segment {
                        micros,
                        start,
                        shape: Shape::Blend(from, to),
                    })
                };
                let on = visit_blend(self.ramp_us, start, T::ZERO, v)
                    && visit_blend(cruise, start + run_up, v, v)
                    && visit_blend(self.ramp_us, -start - run_up, v, T::ZERO)
                    && visit_blend(self.dwell_us, -start, T::ZERO, T::ZERO);
                if !on {
                    return;
                }
            }
        }
        let _ = visit(Segment {
            micros: self.lead_us,
            start: -end,
            shape: Shape::Move(end),
        });
    }
}
