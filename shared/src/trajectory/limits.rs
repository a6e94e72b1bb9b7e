//! Check of a trajectory against the limits.

use super::Trajectory;
use super::elapsed::Elapsed;
use super::error::TrajectoryError;
use super::extremes::Extremes;
use super::phase::{MAX_HZ, MAX_OCTAVES};
use super::reference::Reference;
use super::segment::Segment;
use super::staged::SlowReversals;
use crate::safety::Limits;
use crate::scalar::Scalar;

/// Samples of a Fourier trajectory per period of its fastest harmonic. Between samples a peak is missed by at most
/// (π/256)²/2 = 8·10⁻⁵ of that harmonic's amplitude.
const SAMPLES: u32 = 256;
/// Samples of a sweep's amplitude bound over its whole length, along which it is smooth.
const SWEEP_SAMPLES: u32 = 1024;

/// A sample: a time, and the lowest and highest reference there.
struct Probe<T> {
    micros: u64,
    low: Reference<T>,
    high: Reference<T>,
}

/// Samples a segment that begins at a time (µs) and returns its length, µs.
fn probe_segment<T: Scalar>(
    segment: Segment<T>,
    before: u64,
    visit: &mut dyn FnMut(Probe<T>),
) -> u64 {
    for share in segment.candidates() {
        let micros = (share * f64::from(segment.micros)) as u32;
        let at = segment.at(micros, T::ZERO);
        visit(Probe {
            micros: before + u64::from(micros),
            low: at,
            high: at,
        });
    }
    u64::from(segment.micros)
}

impl<T: Scalar> Trajectory<T> {
    /// Checks that every value is finite and describes a motion.
    ///
    /// # Errors
    /// [`TrajectoryError::BadValue`] with the first field that fails.
    pub fn validate(&self) -> Result<(), TrajectoryError<T>> {
        let finite = |x: &T| x.abs().le(T::from_f64(1.0e6));
        let positive = |x: &T| finite(x) && T::ZERO.lt(*x);
        let check = |good: bool, name| {
            if good {
                Ok(())
            } else {
                Err(TrajectoryError::BadValue(name))
            }
        };
        match self {
            Self::Hold(_) => Ok(()),
            Self::Fourier(m) => {
                check(m.period_us > 0, "period_us")?;
                check(m.ramp_us > 0 && m.ramp_us / 4 <= m.period_us, "ramp_us")?;
                check(m.sine.iter().all(finite), "sine")?;
                check(m.cosine.iter().all(finite), "cosine")
            }
            Self::Chirp(m) => {
                let swept = |hz: &T| positive(hz) && hz.le(T::from_f64(MAX_HZ));
                check(swept(&m.start_hz), "start_hz")?;
                check(swept(&m.end_hz), "end_hz")?;
                let octaves = libm::log2(m.end_hz.to_f64() / m.start_hz.to_f64());
                check(octaves.abs() <= MAX_OCTAVES, "end_hz")?;
                check(m.duration_us > 0, "duration_us")?;
                check(m.ramp_us > 0 && m.ramp_us <= m.duration_us / 2, "ramp_us")?;
                check(positive(&m.amplitude), "amplitude")?;
                check(positive(&m.velocity), "velocity")?;
                check(positive(&m.acceleration), "acceleration")?;
                let share = T::ZERO.le(m.again) && m.again.le(T::ONE);
                check(share, "again")
            }
            Self::Staircase(m) => {
                check(m.levels.iter().all(finite), "levels")?;
                check(m.move_us > 0, "move_us")
            }
            Self::SlowReversals(m) => {
                check(positive(&m.speed), "speed")?;
                check(
                    m.half_turn_us > 0 && m.half_turn_us <= u32::MAX / 2,
                    "half_turn_us",
                )?;
                let fits = |q: &u32| *q >= m.half_turn_us && *q <= u32::MAX / 2;
                check(m.quarter_us.iter().all(fits), "quarter_us")?;
                check(m.cycles > 0, "cycles")
            }
            Self::FrictionSweep(m) => {
                check(positive(&m.half_span), "half_span")?;
                let fits = |c: &u32| *c > 0 && c.checked_add(m.ramp_us).is_some();
                check(m.cruise_us.iter().all(fits), "cruise_us")?;
                check(m.ramp_us > 0, "ramp_us")?;
                check(m.lead_us > 0, "lead_us")
            }
        }
    }

    /// Calls `visit` at all points where the motion can be extreme.
    fn probe(&self, visit: &mut dyn FnMut(Probe<T>)) {
        let mut point = |micros: u64| {
            let at = self.at_elapsed(Elapsed {
                micros,
                fraction: T::ZERO,
            });
            visit(Probe {
                micros,
                low: at,
                high: at,
            });
        };
        match self {
            Self::Hold(_) => point(0),
            Self::Fourier(m) => {
                let harmonics = m.sine.len().max(m.cosine.len()).max(1) as u32;
                let step = u64::from(m.period_us.div_ceil(SAMPLES * harmonics).max(1));
                let (ramp, period) = (u64::from(m.ramp_us), u64::from(m.period_us));
                // Both ramps and one period: the others repeat it.
                let end = self.duration_micros();
                let whole = if m.periods > 0 { period } else { 0 };
                for (from, length) in [(0, ramp + whole), (end - ramp, ramp)] {
                    for k in 0..=length / step {
                        point(from + k * step);
                    }
                }
            }
            Self::Chirp(m) => {
                let phase = m.phase();
                // Thousands of oscillations: their amplitude bounds them without a look at each.
                for k in 0..=u64::from(SWEEP_SAMPLES) {
                    let micros = u64::from(m.duration_us) * k / u64::from(SWEEP_SAMPLES);
                    let time = Elapsed {
                        micros,
                        fraction: T::ZERO,
                    };
                    let high = m.bound(time, &phase);
                    let low = Reference {
                        position: -high.position,
                        ..high
                    };
                    visit(Probe { micros, low, high });
                }
            }
            Self::SlowReversals(m) => {
                // One triangle of each amplitude: the others repeat it.
                let once = SlowReversals {
                    cycles: 1,
                    ..m.clone()
                };
                let mut start = 0_u64;
                for quarter in m.quarter_us.iter().copied() {
                    let mut before = start;
                    let _ = once.triangles(quarter, 0, &mut |segment| {
                        before += probe_segment(segment, before, visit);
                        true
                    });
                    start += m.amplitude_micros(quarter);
                }
            }
            Self::Staircase(_) | Self::FrictionSweep(_) => {
                let mut before = 0_u64;
                self.segments(&mut |segment| {
                    before += probe_segment(segment, before, visit);
                    true
                });
            }
        }
    }

    /// Returns the extremes: upper bounds for a chirp, accurate to 10⁻⁴ for a Fourier series, exact for others.
    pub fn extremes(&self) -> Extremes<T> {
        let mut found = Extremes::<T>::default();
        self.probe(&mut |probe| {
            found.lowest = found.lowest.min(probe.low.position);
            found.highest = found.highest.max(probe.high.position);
            found.velocity = found.velocity.max(probe.high.velocity.abs());
            found.acceleration = found.acceleration.max(probe.high.acceleration.abs());
        });
        found
    }

    /// Checks that the trajectory, started at `start` (rad), stays within the limits.
    ///
    /// # Errors
    /// [`TrajectoryError`]: a value that describes no motion, or the first violated limit with its time.
    pub fn check(&self, limits: &Limits<T>, start: T) -> Result<Extremes<T>, TrajectoryError<T>> {
        self.validate()?;
        // Rounding of the peak must not refuse a motion designed to touch its limit.
        let slack = T::from_f64(1.0 + 1.0e-6);
        let mut failed = None;
        self.probe(&mut |probe| {
            if failed.is_some() {
                return;
            }
            let time = T::from_f64(probe.micros as f64 * 1.0e-6);
            let low = start + probe.low.position;
            let high = start + probe.high.position;
            let speed = probe.high.velocity.abs();
            let acceleration = probe.high.acceleration.abs();
            if !limits.position_low.le(low) {
                failed = Some(TrajectoryError::PositionLow {
                    time,
                    value: low,
                    limit: limits.position_low,
                });
            } else if !high.le(limits.position_high) {
                failed = Some(TrajectoryError::PositionHigh {
                    time,
                    value: high,
                    limit: limits.position_high,
                });
            } else if !speed.le(limits.velocity * slack) {
                failed = Some(TrajectoryError::Velocity {
                    time,
                    value: speed,
                    limit: limits.velocity,
                });
            } else if !acceleration.le(limits.acceleration * slack) {
                failed = Some(TrajectoryError::Acceleration {
                    time,
                    value: acceleration,
                    limit: limits.acceleration,
                });
            }
        });
        match failed {
            Some(error) => Err(error),
            None => Ok(self.extremes()),
        }
    }
}
