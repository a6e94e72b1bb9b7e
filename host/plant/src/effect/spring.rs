//! A cable or hose that pulls the joint back.
//!
//! Not modelled: the cable's hysteresis.

/// Linear torsion spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// N·m/rad.
    pub stiffness: f64,
    /// Angle without torque, rad.
    pub rest: f64,
}

impl Spring {
    /// Torque on the link, N·m.
    #[inline]
    pub fn torque(&self, position: f64) -> f64 {
        -self.stiffness * (position - self.rest)
    }

    /// Stored energy, J.
    pub fn energy(&self, position: f64) -> f64 {
        0.5 * self.stiffness * (position - self.rest) * (position - self.rest)
    }
}
