//! Finite Fourier series: periodic excitation (Swevers et al. 1997, "Optimal robot excitation and identification").

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::elapsed::Elapsed;
use super::reference::Reference;
use super::segment::quintic;
use crate::scalar::Real;

/// Largest number of harmonics of a Fourier trajectory.
pub const HARMONICS: usize = 8;

/// q(t) = E(t)·Σ (aₖ·sin kωt + bₖ·cos kωt), k from 1. The envelope E rises from 0 to 1 over the ramp by the quintic
/// 10s³ − 15s⁴ + 6s⁵, stays at 1 for whole periods and falls likewise, so the motion begins and ends at rest at 0.
/// Phase zero is at the end of the first ramp: the whole periods are exactly periodic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Fourier<T> {
    /// Period of the fundamental, µs.
    pub period_us: u32,
    /// Whole periods at full amplitude.
    pub periods: u16,
    /// Length of each ramp, µs.
    pub ramp_us: u32,
    /// aₖ, rad: amplitudes of the sines from the fundamental upwards.
    pub sine: Vec<T, HARMONICS>,
    /// bₖ, rad: amplitudes of the cosines.
    pub cosine: Vec<T, HARMONICS>,
}

impl<T: Real<Mask = bool>> Fourier<T> {
    pub(super) fn duration_micros(&self) -> u64 {
        2 * u64::from(self.ramp_us) + u64::from(self.period_us) * u64::from(self.periods)
    }

    pub(super) fn map<U>(&self, f: impl Fn(T) -> U) -> Fourier<U> {
        Fourier {
            period_us: self.period_us,
            periods: self.periods,
            ramp_us: self.ramp_us,
            sine: self.sine.iter().map(|x| f(*x)).collect(),
            cosine: self.cosine.iter().map(|x| f(*x)).collect(),
        }
    }

    fn series(&self, time: Elapsed<T>) -> Reference<T> {
        let period = self.period_us.max(1);
        // Time since the end of the ramp, shifted by whole periods so that it is not negative.
        let ahead = period - self.ramp_us % period;
        // In 32 bits if they suffice, because the microcontroller divides them in hardware.
        let since = match u32::try_from(time.micros) {
            Ok(micros) => micros % period,
            Err(_) => (time.micros % u64::from(period)) as u32,
        };
        // The sum of two remainders is below two periods.
        let within = match since.checked_sub(period - ahead) {
            Some(over) => over,
            None => since + ahead,
        };
        // From −½ to ½ of a turn: twice the resolution of 0 to 1.
        let turns = if within > period / 2 {
            -(T::from_u32(period - within) - time.fraction) / T::from_u32(period)
        } else {
            (T::from_u32(within) + time.fraction) / T::from_u32(period)
        };
        let tau = T::from_f64(core::f64::consts::TAU);
        let omega = tau / Elapsed::seconds(period, T::ZERO);
        let (sine, cosine) = (tau * turns).sin_cos();
        let mut sum = Reference::rest(T::ZERO);
        // Harmonics by rotating the fundamental's vector: one sine for all of them.
        let (mut s, mut c, mut w) = (sine, cosine, omega);
        for k in 0..self.sine.len().max(self.cosine.len()) {
            let a = self.sine.get(k).copied().unwrap_or(T::ZERO);
            let b = self.cosine.get(k).copied().unwrap_or(T::ZERO);
            let value = a * s + b * c;
            sum.position += value;
            sum.velocity += w * (a * c - b * s);
            sum.acceleration -= w.squared() * value;
            (s, c) = (s * cosine + c * sine, c * cosine - s * sine);
            w += omega;
        }
        sum
    }

    pub(super) fn at(&self, time: Elapsed<T>) -> Reference<T> {
        let series = self.series(time);
        match envelope(time, self.ramp_us, self.duration_micros()) {
            Some(envelope) => series.under(envelope),
            None => series,
        }
    }
}

/// Returns the envelope within either ramp; none where it is 1.
pub(super) fn envelope<T: Real<Mask = bool>>(
    time: Elapsed<T>,
    ramp_us: u32,
    duration: u64,
) -> Option<Reference<T>> {
    let span = Elapsed::seconds(ramp_us.max(1), T::ZERO);
    let left = duration.saturating_sub(time.micros);
    if time.micros < u64::from(ramp_us) {
        // Below the ramp, so it fits into 32 bits.
        let s = (T::from_u32(time.micros as u32) + time.fraction) / T::from_u32(ramp_us);
        Some(quintic(s, span))
    } else if left <= u64::from(ramp_us) {
        let s = (T::from_u32(left as u32) - time.fraction) / T::from_u32(ramp_us.max(1));
        let mirror = quintic(s, span);
        Some(Reference {
            velocity: -mirror.velocity,
            ..mirror
        })
    } else {
        None
    }
}
