//! The motor current within a pulse. The emulated rig does not resolve it, because it moves by mean voltages.
//!
//! Between driving and braking the current is a sawtooth about its mean. While braking, with both motor wires at one
//! potential, it changes by −(R·i + Kₑ·ω)/L and equals the mean in the middle; driving reverses the change. Left out:
//! the curvature exp(−t·R/L) over a pulse of 50 µs against L/R of about 0.8 ms, and the change from pulse to pulse.

use crate::amplifier::{Amplifier, PULSES};

/// Largest code of the converter.
const LARGEST: f64 = 4095.0;

/// The sawtooth; zero by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ripple {
    /// Delay from the pulses to the sense, s.
    pub delay: f64,
    /// Slope while braking, A/s.
    pub braking: f64,
    /// Share of a pulse that drives, with the sign of the direction.
    pub duty: f64,
    /// Voltage of an edge, V.
    pub supply: f64,
    /// The amplifier, if its error after an edge counts.
    pub amplifier: Option<Amplifier>,
    /// Scale of the current sense.
    pub codes_per_ampere: f64,
}

impl Ripple {
    /// Returns the difference of the current from its mean, A, `after` seconds from the middle of a braking interval.
    pub fn at(&self, after: f64) -> f64 {
        let half = 0.5 / PULSES;
        let after = after - self.delay;
        let within = after - (after * PULSES).round() / PULSES;
        let edge = half * (1.0 - self.duty.abs());
        let distance = within.abs();
        let beside = if distance <= edge {
            distance
        } else {
            edge * (half - distance) / (half - edge)
        };
        (self.braking * beside).copysign(self.braking * within)
    }

    /// Returns the lowest and the highest difference of the reading from the mean current within a pulse, A: at the corners of
    /// the sawtooth, and on both sides of the amplifier's steps.
    pub fn extremes(&self) -> [f64; 2] {
        let edge = 0.5 / PULSES * (1.0 - self.duty.abs());
        let steps = self
            .amplifier
            .map_or(self.delay, |amplifier| amplifier.delay);
        let beside = 1e-9;
        let corners = [self.delay - edge, self.delay + edge];
        let before = [steps - edge - beside, steps + edge - beside];
        let behind = [steps - edge + beside, steps + edge + beside];
        let all = [corners, before, behind].concat();
        all.into_iter().fold([0.0; 2], |[low, high], after| {
            let reading = self.reading_at(after);
            [reading.min(low), reading.max(high)]
        })
    }

    /// Returns the difference of the reading from the mean current, A.
    fn reading_at(&self, after: f64) -> f64 {
        let error = |amplifier: Amplifier| amplifier.error_at(after, self.duty, self.supply);
        self.at(after) + self.amplifier.map_or(0.0, error)
    }

    /// Returns the converter's code, from the code of the mean.
    pub fn on(&self, code: u16, after: f64) -> u16 {
        let moved = f64::from(code) + self.codes_per_ampere * self.reading_at(after);
        moved.round().clamp(0.0, LARGEST) as u16
    }
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn a_sawtooth_about_its_mean_with_both_its_slopes() {
        let ripple = Ripple {
            delay: 0.0,
            braking: -20_000.0,
            duty: 0.4,
            codes_per_ampere: 100.0,
            ..Ripple::default()
        };
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(close(ripple.at(0.0), 0.0) && close(ripple.at(25e-6), 0.0));
        assert!(close(ripple.at(2e-6), -0.04) && close(ripple.at(-2e-6), 0.04));
        // The edge at 15 µs, and the midpoint back to the middle of driving.
        assert!(close(ripple.at(15e-6), -0.3) && close(ripple.at(20e-6), -0.15));
        assert!(close(ripple.at(52e-6), -0.04) && close(ripple.at(-52e-6), 0.04));
        let late = Ripple {
            delay: 1e-6,
            ..ripple
        };
        assert!(close(late.at(1e-6), 0.0) && close(late.at(3e-6), -0.04));
        // The corners lie at the edges of the braking interval.
        let [low, high] = ripple.extremes();
        assert!(close(low, -0.3) && close(high, 0.3), "{low} {high}");
        let [low, high] = late.extremes();
        assert!(close(low, -0.3) && close(high, 0.3), "{low} {high}");
        assert_eq!(ripple.on(2048, 2e-6), 2044);
        assert_eq!(ripple.on(2, 10e-6), 0);
    }
}
