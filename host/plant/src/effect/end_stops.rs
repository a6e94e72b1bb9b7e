//! Mechanical end stops of the joint: one-sided spring and damper that never pull.

/// Stops at both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndStops {
    /// Angles at which contact starts, rad.
    pub range: [f64; 2],
    /// N·m/rad.
    pub stiffness: f64,
    /// N·m·s/rad.
    pub damping: f64,
}

impl EndStops {
    /// Torque on the link, N·m.
    #[inline]
    pub fn torque(&self, position: f64, velocity: f64) -> f64 {
        let [lower, upper] = self.range;
        if position > upper {
            -(self.stiffness * (position - upper) + self.damping * velocity).max(0.0)
        } else if position < lower {
            (self.stiffness * (lower - position) - self.damping * velocity).max(0.0)
        } else {
            0.0
        }
    }

    /// Energy stored in the stop, J.
    pub fn energy(&self, position: f64) -> f64 {
        let depth = (position - self.range[1])
            .max(self.range[0] - position)
            .max(0.0);
        0.5 * self.stiffness * depth * depth
    }
}
