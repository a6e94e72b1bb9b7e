//! Friction with memory: generalised Maxwell-slip elements over a velocity-weakening curve.
//!
//! Sources: Lampaert, Al-Bender & Swevers (2003), "A generalized Maxwell-slip friction model appropriate for control
//! purposes", eqs. 8–10 (elements stick or slip; the slip state is pulled towards its share of the steady curve); Hess
//! & Soom (1990), the rational velocity-weakening form Fc + (Fs − Fc)/(1 + (v/vs)²).
//!
//! Leaves out: strengthening with dwell time, dependence of the stiffness on load, wear.

use super::effect::drag::QuadraticDrag;
use super::effect::load_friction::LoadFriction;
use super::effect::position_friction::PositionFriction;

/// Elements per contact.
const ELEMENTS: usize = 4;
/// Share of the friction torque per element; they sum to 1.
const SHARE: [f64; ELEMENTS] = [0.4, 0.3, 0.2, 0.1];
/// Displacement at which each element yields, as a fraction of the presliding stroke. The virgin curve bends early and
/// flattens late, as measured ones do (Swevers et al. 2000, fig. 2).
const YIELD: [f64; ELEMENTS] = [0.1, 0.3, 0.6, 1.0];

/// Velocity weakening after Hess & Soom (1990).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityWeakening {
    /// Ratio of the torque at vanishing speed to that at high speed, Fs/Fc.
    pub breakaway_ratio: f64,
    /// Speed at which half of the excess has vanished, rad/s.
    pub velocity: f64,
}

/// Elastic contact before gross sliding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Presliding {
    /// Displacement from rest to gross sliding, rad.
    pub stroke: f64,
    /// Damping of the sticking asperities over their stiffness, s.
    pub damping_time: f64,
    /// Time constant with which slipping elements follow the steady curve (frictional lag), s.
    pub lag: f64,
}

/// One sliding contact, in the units of its shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Coulomb torque at high speed, mean of both directions, N·m.
    pub coulomb: f64,
    /// Relative difference between the directions: the Coulomb torque is coulomb·(1 ± asymmetry).
    pub asymmetry: f64,
    /// Viscous coefficient, N·m·s/rad.
    pub viscous: f64,
    /// Velocity weakening; if absent, the breakaway torque is the Coulomb torque.
    pub weakening: Option<VelocityWeakening>,
    /// Contact compliance; a small stroke means almost none.
    pub presliding: Presliding,
    /// Rise of friction with the torque transmitted.
    pub load: Option<LoadFriction>,
    /// Variation of friction over the turn.
    pub position: Option<PositionFriction>,
    /// Torque growing with the square of speed.
    pub drag: Option<QuadraticDrag>,
}

impl Friction {
    /// Returns the same contact on the far side of a reduction: the torque is multiplied by `ratio`, the angle divided
    /// by it. The order of the position dependence is multiplied by `ratio`.
    pub fn seen_through(self, ratio: f64) -> Self {
        // A gear that reverses swaps the directions; friction stays positive.
        let (turn, ratio) = (ratio.signum(), ratio.abs());
        Self {
            coulomb: self.coulomb * ratio,
            asymmetry: self.asymmetry * turn,
            viscous: self.viscous * ratio * ratio,
            weakening: self.weakening.map(|w| VelocityWeakening {
                velocity: w.velocity / ratio,
                ..w
            }),
            presliding: Presliding {
                stroke: self.presliding.stroke / ratio,
                ..self.presliding
            },
            load: self.load,
            position: self.position.map(|p| PositionFriction {
                order: p.order * turn * ratio,
                ..p
            }),
            drag: self.drag.map(|d| QuadraticDrag {
                coefficient: d.coefficient * ratio * ratio * ratio,
            }),
        }
    }

    /// Returns the breakaway torque in the positive and the negative direction, unloaded, N·m.
    pub fn breakaway(&self) -> [f64; 2] {
        let ratio = self.weakening.map_or(1.0, |w| w.breakaway_ratio);
        [1.0 + self.asymmetry, 1.0 - self.asymmetry].map(|side| ratio * self.coulomb * side)
    }
}

/// Reaction of the contact for the integrator: a torque, and a damping for implicit integration.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reaction {
    /// Torque against positive motion, N·m.
    pub(super) torque: f64,
    /// Damping of the sticking elements, N·m·s/rad.
    pub(super) damping: f64,
}

/// Multipliers that change slowly enough to be constant over a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// On the Coulomb and breakaway torques.
    pub(super) coulomb: f64,
    /// Torque added by load, N·m.
    pub(super) load: f64,
}

/// State of one contact, with its constants for one substep length.
#[derive(Clone, Debug)]
pub(super) struct Contact {
    torque: [f64; ELEMENTS],
    /// 1 for a slipping element, 0 for a sticking one: numbers, so that the elements share vector lanes.
    slipping: [f64; ELEMENTS],
    forward: bool,
    stiffness: [f64; ELEMENTS],
    level: [f64; 2],
    excess: f64,
    inverse_velocity: f64,
    damping_time: f64,
    keep: f64,
}

impl Contact {
    pub(super) fn new(friction: &Friction, substep: f64) -> Self {
        let (ratio, inverse_velocity) = friction
            .weakening
            .map_or((1.0, 0.0), |w| (w.breakaway_ratio, 1.0 / w.velocity));
        let breakaway = ratio * friction.coulomb;
        let mut stiffness = [0.0; ELEMENTS];
        for k in 0..ELEMENTS {
            stiffness[k] = SHARE[k] * breakaway / (YIELD[k] * friction.presliding.stroke);
        }
        Self {
            torque: [0.0; ELEMENTS],
            slipping: [0.0; ELEMENTS],
            forward: true,
            stiffness,
            level: [1.0 + friction.asymmetry, 1.0 - friction.asymmetry]
                .map(|side| side * friction.coulomb),
            excess: ratio - 1.0,
            inverse_velocity,
            damping_time: friction.presliding.damping_time,
            keep: (-substep / friction.presliding.lag).exp(),
        }
    }

    /// Advances the contact by `displacement` at `velocity`.
    #[inline]
    pub(super) fn advance(&mut self, velocity: f64, displacement: f64, scale: Scale) -> Reaction {
        let forward = if velocity == 0.0 {
            self.forward
        } else {
            velocity > 0.0
        };
        // At a reversal every element sticks at its current deflection.
        let kept = forward == self.forward;
        self.forward = forward;
        let relative = velocity * self.inverse_velocity;
        let level = if forward {
            self.level[0]
        } else {
            self.level[1]
        };
        let steady =
            scale.coulomb * level * (1.0 + self.excess / (1.0 + relative * relative)) + scale.load;
        let sign = if forward { 1.0 } else { -1.0 };
        let catch = if kept { 1.0 } else { 0.0 };
        let step = sign * displacement;
        let mut torque = [0.0; ELEMENTS];
        let mut stuck = [0.0; ELEMENTS];
        for k in 0..ELEMENTS {
            let limit = SHARE[k] * steady;
            let last = sign * self.torque[k];
            let trial = last + self.stiffness[k] * step;
            let was = catch * self.slipping[k];
            let now = if trial >= limit { 1.0 } else { was };
            let held = if trial >= limit { limit } else { trial };
            let relaxed = limit + (last - limit) * self.keep;
            torque[k] = if was > 0.5 { relaxed } else { held };
            stuck[k] = (1.0 - now) * self.stiffness[k];
            self.slipping[k] = now;
            self.torque[k] = sign * torque[k];
        }
        let sum = (torque[0] + torque[1]) + (torque[2] + torque[3]);
        let stuck = (stuck[0] + stuck[1]) + (stuck[2] + stuck[3]);
        Reaction {
            torque: sign * sum,
            damping: self.damping_time * stuck,
        }
    }

    /// Energy stored in the bent elements, J.
    pub(super) fn stored(&self) -> f64 {
        self.torque
            .iter()
            .zip(&self.stiffness)
            .map(|(f, k)| if *k > 0.0 { 0.5 * f * f / k } else { 0.0 })
            .sum()
    }
}
