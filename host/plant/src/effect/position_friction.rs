//! Tight spots: Coulomb friction that varies over the turn.

/// Coulomb torque multiplied by 1 + amplitude·cos(order·angle + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionFriction {
    /// Relative, below 1.
    pub amplitude: f64,
    /// Periods per turn of the contact's shaft.
    pub order: f64,
    /// rad.
    pub phase: f64,
}

impl PositionFriction {
    /// The multiplier at `angle`.
    pub fn scale(&self, angle: f64) -> f64 {
        1.0 + self.amplitude * (self.order * angle + self.phase).cos()
    }
}
