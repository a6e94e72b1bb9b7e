//! Temperature dependence of copper and magnets.

/// Temperature coefficients about the temperature of the nameplate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindingTemperature {
    /// Of the resistance, 1/K (copper: 0.0039).
    pub resistance: f64,
    /// Of the torque constant, 1/K (NdFeB: −0.0011, ferrite: −0.002).
    pub torque_constant: f64,
}

impl WindingTemperature {
    /// Multipliers on (resistance, torque constant) at `rise` kelvin above the nameplate temperature.
    pub fn scales(&self, rise: f64) -> (f64, f64) {
        (
            1.0 + self.resistance * rise,
            1.0 + self.torque_constant * rise,
        )
    }
}
