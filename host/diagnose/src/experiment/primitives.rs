//! Library of motions: safe, within the limits, and in a file that the rig runs.

use core::f64::consts::TAU;

use rig_excite::COASTING;
use rig_shared::safety::Limits;
use rig_shared::trajectory::{
    Chirp, Fourier, FrictionSweep, Reference, SlowReversals, Staircase, Sweep, Trajectory,
};

use crate::experiment::family::{Family, Hands};
use crate::experiment::place::Place;

/// Used share of each limit.
const SHARE: f64 = 0.8;
/// Shares of the acceleration limit that are tried to stay within the torque limit.
const BRISKNESS: [f64; 4] = [1.0, 0.4, 0.15, 0.05];
/// Longest motion, s; only the warm-up is longer.
const LONGEST: f64 = 120.0;
const WARM_UP: f64 = 600.0;
/// Shortest time at constant speed before and after switching off, s: a host on a slow line is late by less.
const CRUISE: f64 = 0.25;
/// Period of a coasting joint's samples, s.
const COAST_PERIOD: f64 = 0.01;
/// Share of the friction assumed to keep a joint within its range.
const SURE_OF_FRICTION: f64 = 0.5;
/// Share of the amplitude in the second chirp.
const AGAIN: f64 = 0.3;
/// Torque levels of a clamped joint, as shares of the usable torque: up and down in both directions, to show what
/// depends on the direction.
const LEVELS: [f64; 13] = [
    0.2, 0.5, 1.0, 0.5, 0.2, 0.05, -0.05, -0.2, -0.5, -1.0, -0.5, -0.2, -0.05,
];
/// Share of the torque limit on a clamp and a winding at rest.
const CLAMPED: f64 = 0.4;
/// Peak velocity and acceleration of the quintic, per distance over time and over time squared.
const QUINTIC: [f64; 2] = [1.875, 5.773_502_691_896_26];

/// A motion of one joint.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Primitive {
    pub(crate) family: Family,
    pub(crate) hands: Hands,
    /// Start position, rad or m.
    pub(crate) start: f64,
    pub(crate) trajectory: Trajectory<f64>,
    /// Time at which the drive is switched off, s after the start.
    pub(crate) drive_off: Option<f64>,
    pub(crate) figures: Figures,
}

/// Figures of a motion; lengths in rad or m.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Figures {
    /// Constant speeds, per second, over a span.
    Speeds {
        slowest: f64,
        fastest: f64,
        span: f64,
    },
    /// Triangles of some amplitudes at one speed.
    Triangles { amplitudes: Vec<f64>, speed: f64 },
    /// A swept sine, and again at a share of its amplitude.
    Chirp {
        /// First and last frequency, Hz.
        hz: [f64; 2],
        amplitude: f64,
        again: f64,
    },
    /// Steps, each in some seconds.
    Steps { step: f64, seconds: f64 },
    /// A pass at one speed.
    Coast { speed: f64 },
    /// Periods of a sine.
    Sine {
        periods: u16,
        amplitude: f64,
        hz: f64,
    },
    /// Levels of a clamped joint.
    Levels {
        /// Highest level.
        position: f64,
        /// Torque of the controller there, N·m or N.
        torque: f64,
    },
}

impl Primitive {
    /// Returns the recorded duration of one pass, s.
    pub(crate) fn duration(&self) -> f64 {
        (self.drive_off).map_or_else(|| self.trajectory.duration(), |off| off + COASTING)
    }

    /// Returns position, velocity and acceleration from the start in the middle of each of `rows` pieces of a pass. The
    /// flag is true if the drive is on.
    pub(crate) fn way(&self, place: &Place, rows: usize) -> Vec<(Reference<f64>, bool)> {
        let period = self.duration() / rows as f64;
        let time = |k: usize| (k as f64 + 0.5) * period;
        let off = self.drive_off.unwrap_or(f64::INFINITY);
        let mut way: Vec<_> = (0..rows)
            .take_while(|k| time(*k) < off)
            .map(|k| (self.trajectory.at(time(k)), true))
            .collect();
        if way.len() < rows {
            let from = self.trajectory.at(off);
            let begin = [self.start + from.position, from.velocity];
            let coasted = place.coast(begin, 1.0, period, rows - way.len());
            way.extend(
                coasted
                    .into_iter()
                    .map(|[position, velocity, acceleration]| {
                        let position = position - self.start;
                        let at = Reference {
                            position,
                            velocity,
                            acceleration,
                        };
                        (at, false)
                    }),
            );
        }
        way
    }

    /// Returns true if the joint, once its drive is off, stays within its range with half its friction.
    fn stops(&self, place: &Place) -> bool {
        let Some(off) = self.drive_off else {
            return true;
        };
        let at = self.trajectory.at(off);
        let begin = [self.start + at.position, at.velocity];
        let rows = (COASTING / COAST_PERIOD) as usize;
        let way = place.coast(begin, SURE_OF_FRICTION, COAST_PERIOD, rows);
        place.nominal[0] > 0.0 && (way.iter()).all(|[q, ..]| (place.low..=place.high).contains(q))
    }
}

fn micros(seconds: f64) -> Option<u32> {
    let whole = (seconds * 1e6).ceil();
    (whole >= 1.0 && whole <= f64::from(u32::MAX)).then_some(whole as u32)
}

/// Limits of one motion.
struct Allowance {
    distance: f64,
    velocity: f64,
    acceleration: f64,
}

impl Allowance {
    fn move_time(&self, distance: f64) -> f64 {
        let by_velocity = QUINTIC[0] * distance / self.velocity;
        by_velocity.max((QUINTIC[1] * distance / self.acceleration).sqrt())
    }

    /// Returns a motion of a family within these limits, and its figures; `None` if there is none.
    fn build(&self, family: Family) -> Option<(Trajectory<f64>, Figures)> {
        match family {
            Family::ConstantSpeeds => self.constant_speeds(),
            Family::NestedReversals | Family::ReversalsUnderLoad => self.reversals(),
            Family::Chirp => self.chirp(),
            Family::RampsAfterRest => self.ramps(),
            Family::CoastDown => self.coast_down(),
            // A clamped joint has no speed.
            Family::LockedRotor => None,
            Family::Sine => self.sine(30.0),
            Family::WarmUp => self.sine(WARM_UP),
        }
    }

    fn constant_speeds(&self) -> Option<(Trajectory<f64>, Figures)> {
        let (a, v) = (self.distance, self.velocity);
        let slowest = v / 20.0;
        let speeds: Vec<f64> = (0..8)
            .map(|k| slowest * 20f64.powf(f64::from(k) / 7.0))
            .collect();
        let ramp = 1.5 * v / self.acceleration;
        let travel = (2.0 * a - v * ramp).min(6.0 * slowest);
        let half = 0.5 * (travel + v * ramp);
        let sweep = FrictionSweep::new(&speeds, travel, ramp, 0.2, self.move_time(half))?;
        let figures = Figures::Speeds {
            slowest,
            fastest: v,
            span: 2.0 * sweep.half_span,
        };
        Some((Trajectory::FrictionSweep(sweep), figures))
    }

    fn reversals(&self) -> Option<(Trajectory<f64>, Figures)> {
        let (a, v) = (self.distance, self.velocity);
        let turn = (3.0 * v / self.acceleration).max(0.05);
        let least = 1.3 * v * turn;
        let mut amplitudes: Vec<f64> = [1.0, 0.3, 0.1].iter().map(|s| (s * a).max(least)).collect();
        amplitudes.dedup();
        let motion = SlowReversals::new(v, turn, &amplitudes, 3)?;
        let figures = Figures::Triangles {
            amplitudes,
            speed: v,
        };
        Some((Trajectory::SlowReversals(motion), figures))
    }

    fn chirp(&self) -> Option<(Trajectory<f64>, Figures)> {
        let (a, v) = (self.distance, self.velocity);
        let start_hz = 0.25 * v / (TAU * a);
        let end_hz = (4.0 * self.acceleration / (TAU * v)).max(8.0 * start_hz);
        let duration = (5.0 * (end_hz / start_hz).log2() / start_hz).min(0.5 * LONGEST);
        let figures = Figures::Chirp {
            hz: [start_hz, end_hz],
            amplitude: a,
            again: AGAIN,
        };
        let chirp = Chirp {
            start_hz,
            end_hz,
            sweep: Sweep::Logarithmic,
            duration_us: micros(duration)?,
            ramp_us: micros((0.5 / start_hz).min(0.1 * duration))?,
            amplitude: a,
            velocity: v,
            acceleration: self.acceleration,
            again: AGAIN,
        };
        Some((Trajectory::Chirp(chirp), figures))
    }

    fn ramps(&self) -> Option<(Trajectory<f64>, Figures)> {
        let a = self.distance;
        let moving = self.move_time(0.5 * a);
        let levels = [1.0, 2.0, 1.0, 0.0, -1.0, -2.0, -1.0];
        let figures = Figures::Steps {
            step: 0.5 * a,
            seconds: moving,
        };
        let staircase = Staircase {
            levels: levels.iter().map(|l| 0.5 * a * l).collect(),
            move_us: micros(moving)?,
            dwell_us: 4_000_000,
        };
        Some((Trajectory::Staircase(staircase), figures))
    }

    fn coast_down(&self) -> Option<(Trajectory<f64>, Figures)> {
        let (a, v) = (self.distance, self.velocity);
        let ramp = 1.5 * v / self.acceleration;
        let travel = (2.0 * a - v * ramp).min(4.0 * CRUISE * v);
        if travel < 2.0 * CRUISE * v {
            return None;
        }
        let half = 0.5 * (travel + v * ramp);
        let sweep = FrictionSweep::new(&[v], travel, ramp, 0.2, self.move_time(half))?;
        let figures = Figures::Coast { speed: v };
        Some((Trajectory::FrictionSweep(sweep), figures))
    }

    /// Returns a sine of about `long` seconds.
    fn sine(&self, long: f64) -> Option<(Trajectory<f64>, Figures)> {
        let (a, v) = (self.distance, self.velocity);
        let omega = (v / a).min((self.acceleration / a).sqrt());
        let period = TAU / omega;
        let periods = (long / period).clamp(5.0, f64::from(u16::MAX)) as u16;
        // Leaves room for the envelope at the ends.
        let amplitude = 0.9 * a;
        let figures = Figures::Sine {
            periods,
            amplitude,
            hz: 1.0 / period,
        };
        let sine = Fourier {
            period_us: micros(period)?,
            periods,
            ramp_us: micros(2.0 * period)?,
            sine: [amplitude].into_iter().collect(),
            cosine: core::iter::empty().collect(),
        };
        Some((Trajectory::Fourier(sine), figures))
    }
}

/// Returns the switch-off time of a coast-down, s after the start: half-way through its first pass.
fn half_way(trajectory: &Trajectory<f64>) -> Option<f64> {
    let Trajectory::FrictionSweep(sweep) = trajectory else {
        return None;
    };
    let cruise = *sweep.cruise_us.first()?;
    Some(f64::from(sweep.lead_us + sweep.ramp_us + cruise / 2) * 1e-6)
}

/// Returns the staircase of a clamped joint; `None` without a known controller gain or torque limit.
pub(crate) fn clamped(place: &Place) -> Option<Primitive> {
    let highest = CLAMPED * place.torque?;
    let levels = LEVELS.map(|share| share * highest / place.stiffness.unwrap_or(0.0));
    if !levels.iter().all(|level| level.is_finite()) {
        return None;
    }
    Some(Primitive {
        family: Family::LockedRotor,
        hands: Hands::None,
        start: place.middle,
        trajectory: Trajectory::Staircase(Staircase {
            levels: levels.into_iter().collect(),
            move_us: 200_000,
            dwell_us: 1_000_000,
        }),
        drive_off: None,
        figures: Figures::Levels {
            position: levels[2],
            torque: highest,
        },
    })
}

/// Returns all motions of a family at a place, over amplitudes and speeds.
pub(crate) fn of_family(place: &Place, family: Family, hands: Hands) -> Vec<Primitive> {
    let heavy = family == Family::ReversalsUnderLoad;
    let start = if heavy { place.heavy } else { place.middle };
    let room = SHARE * (place.high - start).min(start - place.low);
    let (distances, speeds): (&[f64], &[f64]) = match family {
        Family::NestedReversals | Family::ReversalsUnderLoad => {
            (&[0.5, 0.1, 0.02, 0.004], &[0.1, 0.03, 0.01, 0.003])
        }
        Family::Sine => (&[1.0, 0.3, 0.05], &[1.0, 0.3]),
        Family::WarmUp => (&[1.0], &[1.0]),
        Family::Chirp | Family::RampsAfterRest => (&[1.0, 0.2], &[1.0, 0.2]),
        Family::ConstantSpeeds => (&[1.0], &[1.0, 0.4, 0.15, 0.05, 0.02]),
        // Coasting is not combined with manual work: weight may then carry the joint anywhere.
        Family::CoastDown if place.alone && hands == Hands::None => (&[1.0], &[1.0, 0.4, 0.15]),
        Family::CoastDown | Family::LockedRotor => (&[], &[]),
    };
    let limits = Limits {
        position_low: place.low,
        position_high: place.high,
        velocity: place.velocity,
        acceleration: place.acceleration,
        ..Limits::default()
    };
    let mut list = Vec::new();
    for distance in distances {
        for speed in speeds {
            let long = if family == Family::WarmUp {
                1.2 * WARM_UP
            } else {
                LONGEST
            };
            // The highest acceleration within the torque limit.
            let found = BRISKNESS.iter().find_map(|brisk| {
                let allowance = Allowance {
                    distance: distance * room,
                    velocity: speed * SHARE * place.velocity,
                    acceleration: brisk * SHARE * place.acceleration,
                };
                let (trajectory, figures) = allowance.build(family)?;
                // In single precision, as on the rig.
                let runs = trajectory.to_f32().to_f64().check(&limits, start).is_ok();
                let fits = runs && trajectory.duration() <= long;
                let drive_off = half_way(&trajectory).filter(|_| family == Family::CoastDown);
                let primitive = Primitive {
                    family,
                    hands,
                    start,
                    trajectory,
                    drive_off,
                    figures,
                };
                (fits && place.bears(&primitive.trajectory, start, hands) && primitive.stops(place))
                    .then_some(primitive)
            });
            list.extend(found);
        }
    }
    list
}
