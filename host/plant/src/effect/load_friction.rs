//! Friction that grows with the transmitted torque (tooth and bearing load).
//!
//! Source: Hamon, Gautier & Garrec (2010), friction proportional to |load|.

/// Friction torque added per transmitted torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadFriction {
    /// N·m of friction per N·m transmitted through the gear, both joint-side.
    pub ratio: f64,
}

impl LoadFriction {
    /// Additional friction at `transmitted` N·m, N·m.
    #[inline]
    pub fn torque(&self, transmitted: f64) -> f64 {
        self.ratio * transmitted.abs()
    }
}
