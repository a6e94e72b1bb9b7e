//! Torque ripple: the torque constant varies with the electrical angle, and the back-EMF with it.

/// Torque constant multiplied by 1 + amplitude·cos(order·θ + phase) (θ: rotor angle).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueRipple {
    /// Relative.
    pub amplitude: f64,
    /// Periods per rotor turn: six times the pole pairs for block or imperfect sine commutation.
    pub order: f64,
    /// rad.
    pub phase: f64,
}

impl TorqueRipple {
    /// The multiplier at rotor angle `angle`.
    #[inline]
    pub fn scale(&self, angle: f64) -> f64 {
        1.0 + self.amplitude * (self.order * angle + self.phase).cos()
    }
}
