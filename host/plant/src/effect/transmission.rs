//! Compliance and backlash between rotor and link: two masses, a spring and a gap.
//!
//! Sources: Spong (1987), the elastic joint; Nordin & Gutman (2002), a gap in series with a damped shaft whose contact
//! never pulls. Not modelled: hysteresis of the gear's stiffness, tooth-by-tooth mesh.

/// Elastic gear or shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elasticity {
    /// N·m/rad, joint-side.
    pub stiffness: f64,
    /// Cubic hardening, N·m/rad³.
    pub hardening: f64,
    /// N·m·s/rad.
    pub damping: f64,
}

/// Backlash of a gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backlash {
    /// Whole gap, joint-side, rad.
    pub gap: f64,
    /// Contact stiffness, N·m/rad.
    pub stiffness: f64,
    /// Contact damping, N·m·s/rad.
    pub damping: f64,
}

/// Elasticity, backlash or both in series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transmission {
    half_gap: f64,
    stiffness: f64,
    hardening: f64,
    damping: f64,
}

impl Transmission {
    /// Combines both; returns `None` for a rigid gear.
    pub(crate) fn new(elasticity: Option<Elasticity>, backlash: Option<Backlash>) -> Option<Self> {
        let series = |a: f64, b: f64| if a + b > 0.0 { a * b / (a + b) } else { 0.0 };
        match (elasticity, backlash) {
            (None, None) => None,
            (Some(e), None) => Some(Self {
                half_gap: 0.0,
                stiffness: e.stiffness,
                hardening: e.hardening,
                damping: e.damping,
            }),
            (None, Some(b)) => Some(Self {
                half_gap: 0.5 * b.gap,
                stiffness: b.stiffness,
                hardening: 0.0,
                damping: b.damping,
            }),
            (Some(e), Some(b)) => Some(Self {
                half_gap: 0.5 * b.gap,
                stiffness: series(e.stiffness, b.stiffness),
                hardening: e.hardening,
                damping: series(e.damping, b.damping),
            }),
        }
    }

    /// Returns the torque from rotor to link at `twist` (rotor minus link, joint-side) and its rate, N·m.
    #[inline]
    pub(crate) fn torque(&self, twist: f64, rate: f64) -> f64 {
        let bend = self.bend(twist);
        if bend == 0.0 && self.half_gap > 0.0 {
            return 0.0;
        }
        let torque = self.torque_elastic(twist) + self.damping * rate;
        // With a gap the contact can only push; a shaft without a gap can push and pull.
        if self.half_gap > 0.0 && torque * bend < 0.0 {
            0.0
        } else {
            torque
        }
    }

    /// Returns the conservative part of the torque, N·m.
    #[inline]
    pub(crate) fn torque_elastic(&self, twist: f64) -> f64 {
        let bend = self.bend(twist);
        bend * (self.stiffness + self.hardening * bend * bend)
    }

    /// Returns the energy of the bent shaft, J.
    pub(crate) fn energy(&self, twist: f64) -> f64 {
        let square = self.bend(twist).powi(2);
        square * (0.5 * self.stiffness + 0.25 * self.hardening * square)
    }

    #[inline]
    fn bend(&self, twist: f64) -> f64 {
        twist - twist.clamp(-self.half_gap, self.half_gap)
    }
}
