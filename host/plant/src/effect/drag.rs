//! Drag of air and churning grease.

/// Torque coefficient·ω·|ω| against motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticDrag {
    /// N·m·s²/rad².
    pub coefficient: f64,
}

impl QuadraticDrag {
    /// Returns the viscous coefficient that is equivalent to the drag at this speed, N·m·s/rad.
    #[inline]
    pub fn viscous_at(&self, velocity: f64) -> f64 {
        self.coefficient * velocity.abs()
    }
}
