//! Motor and link with a spring between them: velocity of the motor per torque.
//!
//! Jm·θ̈ + fm·θ̇ + d·(θ̇ − q̇) + c·(θ − q) = τ,  Jl·q̈ + fl·q̇ + d·(q̇ − θ̇) + c·(q − θ) + kg·q = 0
//!
//! with kg, the derivative of the gravity torque by the position (Spong 1987; Pham & Gautier 1991 for the identification).
//! Antiresonance ωa² = (c + kg)/Jl, where the link swings against a motor at rest; resonance ωr² ≈ c·(1/Jl + 1/Jm).
//!
//! Coulomb friction of motor and link are further inputs: that of the link acts on the motor through the spring. So is the
//! torque that a gap in series with the spring takes away: it acts on both masses.
//!
//! A controller may hold the torque from one row to the next. What the rows show of the motion is then the response at the
//! frequency and at all its aliases, each by the hold (Åström & Wittenmark 1997, ch. 2 and 7).
//!
//! The recorded motion of the other joints puts a torque on the link, a further input.
//!
//! Leaves out: friction that depends on speed, position or load otherwise; modes beyond the first; a torque that is held for
//! longer than a row.

use nalgebra::Complex;

/// Complex number.
pub(crate) type C = Complex<f64>;

/// Torque of gravity on a link, by the description.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gravity {
    /// Torque that holds the link at the mean pose, N·m.
    pub held: f64,
    /// First derivative there, N·m/rad.
    pub slope: f64,
    /// Second derivative there, N·m/rad².
    pub curvature: f64,
}

impl Gravity {
    /// Returns the torque that holds the link at a position from the mean pose. Exact for a joint that turns; that of a
    /// joint that slides does not depend on its position.
    pub(super) fn torque(&self, position: f64) -> f64 {
        let (sin, cos) = position.sin_cos();
        self.held + self.slope * sin + self.curvature * (1.0 - cos)
    }
}

/// Parameters of the model.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TwoMass {
    /// c, N·m/rad; infinite for a rigid joint.
    pub stiffness: f64,
    /// Jl, kg·m².
    pub link_inertia: f64,
    /// Jm, kg·m², joint side.
    pub motor_inertia: f64,
    /// d, N·m·s/rad.
    pub damping: f64,
    /// fm, N·m·s/rad.
    pub viscous: f64,
    /// fl, N·m·s/rad.
    pub link_viscous: f64,
    /// Coulomb friction of the motor, N·m.
    pub coulomb: f64,
    /// Coulomb friction of the link, N·m.
    pub link_coulomb: f64,
    /// Whole gap of the backlash, rad.
    pub gap: f64,
    /// Delay of the velocity after the torque, s.
    pub delay: f64,
    /// kg, N·m/rad.
    pub gravity: f64,
    /// Time for which the recorded torque is held, s; 0 if it is that of the instant.
    pub hold: f64,
}

/// Aliases on either side that count, up to a frequency as a share of the rate of the rows. Those beyond change the response of
/// an inertia by less than a thousandth.
const ALIASES: [(f64, i32); 3] = [(0.1, 1), (0.2, 2), (f64::INFINITY, 4)];

/// Damping over the antiresonance and the link's inertia below which there is none.
const UNDAMPED: f64 = 1e-4;

impl TwoMass {
    /// Returns velocity per recorded torque at an angular frequency, rad/s: that of the torque which acts, or of one that is
    /// held from row to row.
    pub(crate) fn recorded(&self, omega: f64) -> C {
        let period = self.hold;
        if period == 0.0 || omega == 0.0 {
            return self.response(omega);
        }
        let rate = std::f64::consts::TAU / period;
        let last = (ALIASES.iter())
            .find(|(share, _)| omega.abs() < share * rate)
            .map_or(0, |(_, last)| *last);
        // The position is sampled; its velocity is that of the position at this frequency.
        let of_alias = |k: i32| {
            let s = C::new(0.0, omega + f64::from(k) * rate);
            self.response(s.im) / (s * s)
        };
        let sum: C = (-last..=last).map(of_alias).sum();
        let s = C::new(0.0, omega);
        sum * s * (C::new(1.0, 0.0) - (-s * period).exp()) / period
    }

    /// Returns velocity per torque at an angular frequency, rad/s.
    pub(crate) fn response(&self, omega: f64) -> C {
        let s = C::new(0.0, omega);
        // Torque that the link takes per position of the motor.
        let link = self.link(s);
        let behind = match self.stiffness.is_finite() {
            true => {
                let spring = s * self.damping + self.stiffness;
                spring * link / (link + spring)
            }
            false => link,
        };
        let impedance = s * self.motor_inertia + self.viscous + behind / s;
        C::from_polar(1.0, -omega * self.delay) / impedance
    }

    /// Returns the torque on the motor per torque on the link, through the spring.
    pub(crate) fn through_spring(&self, omega: f64) -> C {
        if !self.stiffness.is_finite() {
            return C::new(1.0, 0.0);
        }
        let s = C::new(0.0, omega);
        let spring = s * self.damping + self.stiffness;
        spring / (self.link(s) + spring)
    }

    /// Torque per position of the link alone.
    fn link(&self, s: C) -> C {
        s * s * self.link_inertia + s * self.link_viscous + self.gravity
    }

    /// Antiresonance, rad/s.
    pub(crate) fn antiresonance(&self) -> f64 {
        ((self.stiffness + self.gravity) / self.link_inertia).sqrt()
    }

    /// Returns true if there is no damping: a fit has gone to the end of its range.
    pub(crate) fn is_undamped(&self) -> bool {
        self.damping < UNDAMPED * self.antiresonance() * self.link_inertia
    }

    /// Resonance, rad/s: the upper natural frequency of both masses without damping.
    pub(crate) fn resonance(&self) -> f64 {
        // λ² − (c/Jm + (c + kg)/Jl)·λ + c·kg/(Jm·Jl) = 0.
        let sum = self.stiffness / self.motor_inertia
            + (self.stiffness + self.gravity) / self.link_inertia;
        let product = self.stiffness * self.gravity / (self.motor_inertia * self.link_inertia);
        (0.5 * sum + (0.25 * sum * sum - product).max(0.0).sqrt()).sqrt()
    }
}
