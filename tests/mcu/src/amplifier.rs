//! Error of the current amplifier after an edge of the bridge moves both of its inputs together.
//!
//! The shunt lies in the wire of one half bridge. At an edge of that half bridge both ends of the shunt move by the whole
//! supply. The output of the amplifier moves with them and returns exponentially: a common-mode step of a sensor in line
//! with the motor. The other half bridge moves neither end.

/// Pulses of the bridge a second.
pub(crate) const PULSES: f64 = 20_000.0;
/// Share of the first error that is left after the settling time.
const SETTLED: f64 = 0.005;

/// Half bridge whose wire has the shunt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shunt {
    /// The first: it switches while the duty is negative.
    First,
    /// The second: it switches while the duty is positive.
    Second,
}

/// The amplifier and its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplifier {
    /// Place of the shunt.
    pub shunt: Shunt,
    /// Delay from an edge at the bridge's inputs to the edge at the shunt, s.
    pub delay: f64,
    /// First error per step of the common-mode voltage, A/V; of either sign.
    pub error: f64,
    /// Time from an edge at the shunt until 0.5 % of the first error is left, s.
    pub settling: f64,
}

impl Amplifier {
    /// Returns the error of the reading, A, `after` seconds from the middle of a braking interval at the bridge's inputs, at
    /// a duty from −1 to 1 of the supply, V.
    pub fn error_at(&self, after: f64, duty: f64, supply: f64) -> f64 {
        let switches = match self.shunt {
            Shunt::First => duty < 0.0,
            Shunt::Second => duty > 0.0,
        };
        // At full duty nothing switches either.
        if !switches || duty.abs() >= 1.0 {
            return 0.0;
        }
        let pulse = 1.0 / PULSES;
        let edge = 0.5 * pulse * (1.0 - duty.abs());
        let decay = SETTLED.ln() / self.settling;
        let left = |since: f64| (decay * since.rem_euclid(pulse)).exp();
        let after = after - self.delay;
        // Braking begins with both outputs high, and ends as one of them falls.
        self.error * supply * (left(after + edge) - left(after - edge))
    }
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn the_error_jumps_at_each_edge_and_settles() {
        let amplifier = Amplifier {
            shunt: Shunt::Second,
            delay: 0.6e-6,
            error: 0.2,
            settling: 9.6e-6,
        };
        let at = |after: f64| amplifier.error_at(after, 0.7, 24.0);
        // Braking lasts 15 µs, from 6.9 µs before to 8.1 µs after the middle at the inputs.
        let (rise, fall) = (-6.9e-6, 8.1e-6);
        for (edge, step) in [(rise, 4.8), (fall, -4.8)] {
            assert!((at(edge + 1e-12) - at(edge - 1e-12) - step).abs() < 1e-4);
            let settled = at(edge + 9.6e-6) - step * SETTLED;
            // The other edge lies 15 or 35 µs back.
            assert!(settled.abs() < 4.8 * 0.005_f64.powf(1.5), "{settled}");
        }
        assert!((at(rise + 3e-6) / at(rise + 6e-6) - 200_f64.powf(3.0 / 9.6)).abs() < 1e-2);
        // One pulse later it is the same.
        assert!((at(1e-6 + 50e-6) - at(1e-6)).abs() < 1e-9);
    }

    #[test]
    fn the_half_bridge_without_the_shunt_makes_no_error() {
        let mut amplifier = Amplifier {
            shunt: Shunt::First,
            delay: 0.0,
            error: 0.2,
            settling: 9.6e-6,
        };
        let at = |amplifier: &Amplifier, duty| amplifier.error_at(0.0, duty, 24.0).abs();
        assert!(at(&amplifier, 0.7) == 0.0 && at(&amplifier, -0.7) > 0.01);
        amplifier.shunt = Shunt::Second;
        assert!(at(&amplifier, -0.7) == 0.0 && at(&amplifier, 0.7) > 0.01);
        for still in [0.0, 1.0] {
            assert!(at(&amplifier, still) == 0.0);
        }
    }
}
