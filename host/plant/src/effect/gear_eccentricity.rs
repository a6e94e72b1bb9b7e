//! Eccentric gear: the lever arm of preloaded teeth varies, which causes a torque once (or `order` times) per motor
//! turn.
//!
//! Not modelled: the kinematic error of the output angle; this is only its static torque.

/// Torque amplitude·sin(order·θ + phase) on the joint, conservative (θ: rotor angle).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GearEccentricity {
    /// N·m at the joint.
    pub amplitude: f64,
    /// Periods per rotor turn.
    pub order: f64,
    /// rad.
    pub phase: f64,
}

impl GearEccentricity {
    /// Joint-side torque on the rotor side of the gear, N·m.
    #[inline]
    pub fn torque(&self, angle: f64) -> f64 {
        self.amplitude * (self.order * angle + self.phase).sin()
    }

    /// Potential energy, J, over a reduction of `ratio`.
    pub fn energy(&self, angle: f64, ratio: f64) -> f64 {
        self.amplitude / (self.order * ratio) * (self.order * angle + self.phase).cos()
    }
}
