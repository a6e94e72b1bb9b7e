//! Reference position in each mode.

use rig_shared::trajectory::Reference;

/// A reference that stops at constant deceleration, one control tick at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Braking {
    position: f32,
    velocity: f32,
}

impl Braking {
    /// Starts from the present reference.
    pub fn from(reference: Reference<f32>) -> Self {
        Self {
            position: reference.position,
            velocity: reference.velocity,
        }
    }

    /// Advances one tick of `period` seconds at `deceleration` rad/s². The velocity ends at exactly zero.
    pub fn step(&mut self, deceleration: f32, period: f32) -> Reference<f32> {
        let change = deceleration * period;
        let before = self.velocity;
        self.velocity = if before.abs() <= change {
            0.0
        } else {
            before - change.copysign(before)
        };
        self.position += 0.5 * (before + self.velocity) * period;
        Reference {
            position: self.position,
            velocity: self.velocity,
            acceleration: (self.velocity - before) / period,
        }
    }

    /// Returns true if the reference is at rest.
    pub fn at_rest(&self) -> bool {
        self.velocity == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braking_distance_is_that_of_constant_deceleration() {
        let start = Reference {
            position: 1.0,
            velocity: -2.0,
            acceleration: 0.0,
        };
        let mut braking = Braking::from(start);
        let (deceleration, period) = (8.0, 1e-4);
        let mut ticks = 0;
        while !braking.at_rest() {
            braking.step(deceleration, period);
            ticks += 1;
            assert!(ticks < 10_000);
        }
        // v²/2a = 0.25 rad in v/a = 0.25 s.
        assert!((braking.position - 0.75).abs() < 1e-4);
        assert!((f64::from(ticks) * f64::from(period) - 0.25).abs() < 1e-3);
        assert_eq!(braking.step(deceleration, period).velocity, 0.0);
    }
}
