//! Friction that decreases as the grease warms: one thermal mass, heated by the friction losses.
//!
//! Source: Bittencourt & Gunnarsson (2012), exponential decrease of the viscous part with temperature. Not modelled:
//! gradients within the gear, heat from the motor.

/// Thermal mass of gear and grease, and the dependence of friction on its temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionWarmup {
    /// J/K.
    pub heat_capacity: f64,
    /// To the surroundings, K/W.
    pub thermal_resistance: f64,
    /// Relative decrease of the viscous coefficient per kelvin, 1/K.
    pub viscous_rate: f64,
    /// Relative decrease of the Coulomb torque per kelvin, 1/K.
    pub coulomb_rate: f64,
}

impl FrictionWarmup {
    /// Multipliers on (Coulomb, viscous) at `rise` kelvin above the surroundings.
    pub fn scales(&self, rise: f64) -> (f64, f64) {
        (
            (-self.coulomb_rate * rise).exp(),
            (-self.viscous_rate * rise).exp(),
        )
    }

    /// Temperature rise after `heat` joules within `tick` seconds.
    pub fn next(&self, rise: f64, heat: f64, tick: f64) -> f64 {
        let keep = (-tick / (self.heat_capacity * self.thermal_resistance)).exp();
        keep * rise + heat / self.heat_capacity
    }
}
