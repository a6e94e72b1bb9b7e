//! A compliant surface that the tool touches.

use super::error::{ControlError, within};

/// A plane with stiffness and damping (Kelvin–Voigt), which pushes and does not pull, and Coulomb friction along it.
///
/// Leaves out: the mass of the surface, rolling and torsional friction, and the shape of the tool, which touches in one
/// point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Surface {
    /// N/m
    pub stiffness: f64,
    /// N·s/m
    pub damping: f64,
    /// Coefficient of Coulomb friction.
    pub friction: f64,
    /// Distance of the tool's start from the surface, m.
    pub gap: f64,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            stiffness: 1e4,
            damping: 0.0,
            friction: 0.2,
            gap: 0.005,
        }
    }
}

/// Speed of the tool at which friction of the surface is full, m/s: below it the force is proportional to the speed.
const CREEP: f64 = 1e-3;

impl Surface {
    /// Checks the surface.
    ///
    /// # Errors
    /// [`ControlError::Setting`].
    pub fn check(&self) -> Result<(), ControlError> {
        within(
            "surface stiffness",
            self.stiffness,
            10.0..=1e6,
            "it must be between 10 and 1000000 N/m",
        )?;
        within(
            "surface damping",
            self.damping,
            0.0..=1e5,
            "it must be between 0 and 100000 N·s/m",
        )?;
        within(
            "surface friction",
            self.friction,
            0.0..=2.0,
            "it must be between 0 and 2",
        )?;
        within("gap", self.gap, 0.0..=0.5, "it must be between 0 and 0.5 m")
    }

    /// Returns the force that presses the surface, N, at a depth (m) and its rate (m/s).
    pub fn pressure(&self, depth: f64, rate: f64) -> f64 {
        if depth <= 0.0 {
            return 0.0;
        }
        (self.stiffness * depth + self.damping * rate).max(0.0)
    }

    /// Returns the force of the surface on the tool in the base frame, N. `normal` points into the surface.
    pub(crate) fn force(&self, normal: [f64; 3], depth: f64, velocity: [f64; 3]) -> [f64; 3] {
        let rate: f64 = normal.iter().zip(velocity).map(|(n, v)| n * v).sum();
        let pressure = self.pressure(depth, rate);
        let slip: [f64; 3] = core::array::from_fn(|k| velocity[k] - rate * normal[k]);
        let speed = slip.iter().map(|v| v * v).sum::<f64>().sqrt();
        let drag = self.friction * pressure / speed.max(CREEP);
        core::array::from_fn(|k| -pressure * normal[k] - drag * slip[k])
    }
}
