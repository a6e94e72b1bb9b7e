//! Iron saturation: the torque constant decreases at high current.
//!
//! Not modelled: the decrease of the inductance. The back-EMF constant decreases equally, which keeps the power
//! balance.

/// Torque constant multiplied by 1/(1 + (i/knee)²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueSaturation {
    /// Current at which the torque constant is halved, A (far above rated).
    pub knee: f64,
}

impl TorqueSaturation {
    /// The multiplier at `current`.
    #[inline]
    pub fn scale(&self, current: f64) -> f64 {
        let relative = current / self.knee;
        1.0 / (1.0 + relative * relative)
    }
}
