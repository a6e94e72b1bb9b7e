//! Swept sine whose amplitude falls with frequency so that velocity and acceleration stay within their limits.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::elapsed::Elapsed;
use super::fourier::envelope;
use super::phase::Phase;
use super::reference::Reference;
use super::sweep::Sweep;
use crate::scalar::Scalar;

/// q(t) = E(t)·A(f)·sin φ(t) with φ' = 2πf and A(f) = A₀/√(1 + (ω/ωv)² + (ω/ωa)⁴), ωv = v/A₀, ωa² = a/A₀: then A ≤ A₀,
/// A·ω ≤ v and A·ω² ≤ a. Envelope and sweep add to that; the part is small for slow sweeps, and the check includes it.
///
/// The phase is computed in whole numbers, because after hundreds of turns an `f32` has no digits for the angle. A
/// logarithmic sweep over less than 1/4096 octave runs as a linear one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Chirp<T> {
    /// Frequency at the start, Hz.
    pub start_hz: T,
    /// Frequency at the end, Hz.
    pub end_hz: T,
    /// Law of the frequency between them.
    pub sweep: Sweep,
    /// Length of one pass with both ramps, µs.
    pub duration_us: u32,
    /// Length of the ramps of the amplitude at start and end, µs.
    pub ramp_us: u32,
    /// Largest amplitude A₀, rad.
    pub amplitude: T,
    /// Largest velocity v, rad/s.
    pub velocity: T,
    /// Largest acceleration a, rad/s².
    pub acceleration: T,
    /// Amplitude of a second pass of the same length as a share of the first, at most 1; 0 for no second pass. A linear
    /// system answers both alike; backlash and friction do not.
    pub again: T,
}

impl<T: Scalar> Chirp<T> {
    pub(super) fn map<U>(&self, f: impl Fn(T) -> U) -> Chirp<U> {
        Chirp {
            start_hz: f(self.start_hz),
            end_hz: f(self.end_hz),
            sweep: self.sweep,
            duration_us: self.duration_us,
            ramp_us: self.ramp_us,
            amplitude: f(self.amplitude),
            velocity: f(self.velocity),
            acceleration: f(self.acceleration),
            again: f(self.again),
        }
    }

    /// Length of all passes, µs.
    pub(super) fn duration_micros(&self) -> u64 {
        let twice = T::ZERO.lt(self.again);
        u64::from(self.duration_us) << u32::from(twice)
    }

    /// Returns the constants of its phase.
    pub(super) fn phase(&self) -> Phase<T> {
        let [start, end] = [self.start_hz, self.end_hz].map(T::to_f64);
        Phase::new(start, end, self.sweep, self.duration_us)
    }

    /// Returns the phase within a turn (rad), the angular frequency and its first two derivatives.
    #[inline(always)]
    fn angle(&self, time: Elapsed<T>, phase: &Phase<T>) -> (T, [T; 3]) {
        // The time is below the length, which fits into 32 bits.
        let micros = time.micros as u32;
        let change = self.end_hz - self.start_hz;
        let point = phase.at(micros, self.start_hz, change);
        let tau = T::from_f64(core::f64::consts::TAU);
        let w = [point.hz, point.slope, point.bend].map(|x| tau * x);
        // The fraction of a microsecond; the change of frequency within it is negligible.
        let rest = w[0] * time.fraction * T::from_f64(1e-6);
        (tau * point.turns + rest, w)
    }

    /// Returns the amplitude and its first two time derivatives, from the angular frequency and its derivatives.
    fn amplitude(&self, [w, w1, w2]: [T; 3]) -> Reference<T> {
        let f = T::from_f64;
        let (v, a) = (
            self.amplitude / self.velocity,
            self.amplitude / self.acceleration,
        );
        let (p, q) = (v.squared(), a.squared());
        let square = w.squared();
        let d = T::ONE + p * square + q * square.squared();
        let d1 = (f(2.0) * p * w + f(4.0) * q * square * w) * w1;
        let d2 = (f(2.0) * p + f(12.0) * q * square) * w1.squared()
            + (f(2.0) * p * w + f(4.0) * q * square * w) * w2;
        let value = self.amplitude / d.sqrt();
        let over = T::ONE / d;
        let (d1, d2) = (d1 * over, d2 * over);
        Reference {
            position: value,
            velocity: -f(0.5) * value * d1,
            acceleration: value * (f(0.75) * d1.squared() - f(0.5) * d2),
        }
    }

    /// Returns the amplitude with its envelope, the phase, the angular frequency and its derivative.
    #[inline(always)]
    fn carrier(&self, time: Elapsed<T>, phase: &Phase<T>) -> (Reference<T>, T, T, T) {
        let (angle, frequency) = self.angle(time, phase);
        let amplitude = self.amplitude(frequency);
        let [w, w1, _] = frequency;
        let amplitude = match envelope(time, self.ramp_us, u64::from(self.duration_us)) {
            Some(envelope) => amplitude.under(envelope),
            None => amplitude,
        };
        (amplitude, angle, w, w1)
    }

    /// Returns the time within its pass, and the amplitude share of that pass.
    #[inline(always)]
    fn pass(&self, time: Elapsed<T>) -> (Elapsed<T>, T) {
        match time.micros.checked_sub(u64::from(self.duration_us)) {
            Some(micros) => (Elapsed { micros, ..time }, self.again),
            None => (time, T::ONE),
        }
    }

    #[inline(always)]
    pub(super) fn at(&self, time: Elapsed<T>, phase: &Phase<T>) -> Reference<T> {
        let (time, share) = self.pass(time);
        let (amplitude, angle, w, w1) = self.carrier(time, phase);
        let (s, c) = angle.sin_cos();
        let sine = Reference {
            position: s,
            velocity: w * c,
            acceleration: w1 * c - w.squared() * s,
        };
        sine.under(amplitude).scaled(share)
    }

    /// Returns bounds of position, velocity and acceleration at a time of the first pass, for any phase. The second
    /// pass is smaller.
    pub(super) fn bound(&self, time: Elapsed<T>, phase: &Phase<T>) -> Reference<T> {
        let (amplitude, _, w, w1) = self.carrier(time, phase);
        let two = T::from_f64(2.0);
        let length = |x: T, y: T| (x.squared() + y.squared()).sqrt();
        Reference {
            position: amplitude.position,
            velocity: length(amplitude.velocity, amplitude.position * w),
            acceleration: length(
                amplitude.acceleration - amplitude.position * w.squared(),
                two * amplitude.velocity * w + amplitude.position * w1,
            ),
        }
    }
}
