//! Swept sine whose amplitude falls with frequency so that velocity and acceleration stay within their limits.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::fourier::envelope;
use super::{Elapsed, Reference};
use crate::pair::Pair;
use crate::scalar::Scalar;

/// How the frequency runs from start to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Sweep {
    /// The same change each second.
    Linear,
    /// The same ratio each second; both frequencies above zero.
    Logarithmic,
}

/// q(t) = E(t)·A(f)·sin φ(t) with φ' = 2πf and A(f) = A₀/√(1 + (ω/ωv)² + (ω/ωa)⁴), ωv = v/A₀, ωa² = a/A₀: then A ≤ A₀,
/// A·ω ≤ v and A·ω² ≤ a. What envelope and sweep add to that is small for slow sweeps and counted by the check.
///
/// The phase is computed with twice the scalar's digits, because hundreds of turns leave an `f32` none for the angle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Chirp<T> {
    /// Frequency at the start, Hz.
    pub start_hz: T,
    /// Frequency at the end, Hz.
    pub end_hz: T,
    /// How it runs between them.
    pub sweep: Sweep,
    /// Length with both ramps, µs.
    pub duration_us: u32,
    /// Length of the ramps of the amplitude at start and end, µs.
    pub ramp_us: u32,
    /// Largest amplitude A₀, rad.
    pub amplitude: T,
    /// Largest velocity v, rad/s.
    pub velocity: T,
    /// Largest acceleration a, rad/s².
    pub acceleration: T,
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
        }
    }

    /// Phase within a turn (rad), angular frequency and its first two derivatives.
    fn phase(&self, time: Elapsed<T>) -> (T, [T; 3]) {
        let million = Pair::from_u32(1_000_000);
        let length = Pair::from_u32(self.duration_us.max(1)) / million;
        let micros = u32::try_from(time.micros).unwrap_or(u32::MAX);
        let seconds = (Pair::from_u32(micros) + Pair::new(time.fraction)) / million;
        let (low, high) = (Pair::new(self.start_hz), Pair::new(self.end_hz));
        let (turns, hz) = match self.sweep {
            Sweep::Linear => {
                let slope = (high - low) / length;
                let gained = slope * seconds;
                let turns = seconds * (low + gained * Pair::new(T::from_f64(0.5)));
                (turns, [(low + gained).value(), slope.value(), T::ZERO])
            }
            Sweep::Logarithmic => {
                let change = (high / low).ln();
                let rate = change / length;
                let hz = low * (rate * seconds).exp();
                // A sweep without change has no rate to divide by.
                let turns = if change.value().abs().lt(T::from_f64(1e-9)) {
                    low * seconds
                } else {
                    (hz - low) / rate
                };
                let (hz, rate) = (hz.value(), rate.value());
                (turns, [hz, rate * hz, rate.squared() * hz])
            }
        };
        let tau = T::from_f64(core::f64::consts::TAU);
        (tau * turns.beside_whole(), hz.map(|x| tau * x))
    }

    /// Amplitude and its first two time derivatives, from the angular frequency and its.
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
        Reference {
            position: value,
            velocity: -f(0.5) * value * d1 / d,
            acceleration: value * (f(0.75) * (d1 / d).squared() - f(0.5) * d2 / d),
        }
    }

    /// Amplitude under the envelope, angular frequency and its derivative.
    fn carrier(&self, time: Elapsed<T>) -> (Reference<T>, T, T, T) {
        let (angle, frequency) = self.phase(time);
        let amplitude = self.amplitude(frequency);
        let [w, w1, _] = frequency;
        let amplitude = match envelope(time, self.ramp_us, u64::from(self.duration_us)) {
            Some(envelope) => amplitude.under(envelope),
            None => amplitude,
        };
        (amplitude, angle, w, w1)
    }

    pub(super) fn at(&self, time: Elapsed<T>) -> Reference<T> {
        let (amplitude, angle, w, w1) = self.carrier(time);
        let (s, c) = angle.sin_cos();
        let sine = Reference {
            position: s,
            velocity: w * c,
            acceleration: w1 * c - w.squared() * s,
        };
        sine.under(amplitude)
    }

    /// What position, velocity and acceleration cannot exceed at a time, whatever the phase.
    pub(super) fn bound(&self, time: Elapsed<T>) -> Reference<T> {
        let (amplitude, _, w, w1) = self.carrier(time);
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
