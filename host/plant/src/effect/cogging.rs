//! Cogging: the rotor's magnets prefer certain angles even without current.

/// Torque amplitude·sin(order·θ + phase) at the rotor, conservative (θ: rotor angle).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cogging {
    /// N·m at the rotor.
    pub amplitude: f64,
    /// Periods per rotor turn: the least common multiple of slots and poles.
    pub order: f64,
    /// rad.
    pub phase: f64,
}

impl Cogging {
    /// Torque on the rotor at rotor angle `angle`, N·m.
    #[inline]
    pub fn torque(&self, angle: f64) -> f64 {
        self.amplitude * (self.order * angle + self.phase).sin()
    }

    /// Returns its potential energy, J: the torque is the negative slope.
    pub fn energy(&self, angle: f64) -> f64 {
        self.amplitude / self.order * (self.order * angle + self.phase).cos()
    }
}
