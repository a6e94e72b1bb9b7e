//! Time within a trajectory.

use crate::scalar::Real;

/// Microseconds in a second.
pub(super) const MICROS: u64 = 1_000_000;

/// A point in time: whole microseconds and a fraction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elapsed<T> {
    pub(super) micros: u64,
    /// Share of a microsecond, 0 to 1.
    pub(super) fraction: T,
}

impl<T: Real> Elapsed<T> {
    pub(super) fn from_tick(tick: u64, rate_hz: u32) -> Self {
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
    pub(super) fn seconds(micros: u32, fraction: T) -> T {
        (T::from_u32(micros) + fraction) * T::from_f64(1.0e-6)
    }
}
