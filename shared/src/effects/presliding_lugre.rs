//! Presliding friction with memory of distance and speed, LuGre law (Canudas de Wit).

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct PreslidingLugre;

impl Law for PreslidingLugre {
    const ABOUT: About = About {
        name: "presliding",
        law: Some("lugre"),
        title: "presliding friction",
        equation: "coulomb · (z − sgn q̇) + micro_damping · (q̇ − |q̇|·z/g), dz/dq = (1 − z·sgn q̇/g)/stroke, g = 1 + breakaway · exp(−(q̇/velocity)²)",
        source: "Canudas de Wit, Olsson, Astrom, Lischinsky 1995, eq. 1 to 3",
        channel: Channel::Torque,
        direction: Direction::Dry,
        gains: &[
            Parameter {
                name: "coulomb",
                unit: "N*m",
                bounds: [0.0, f64::INFINITY],
                range: [0.05, 2.0],
                scale: Scale::Logarithmic,
                meaning: "the part of the joint's Coulomb friction that builds up over the stroke",
            },
            Parameter {
                name: "micro_damping",
                unit: "N*m*s/rad",
                bounds: [0.0, f64::INFINITY],
                range: [0.01, 20.0],
                scale: Scale::Logarithmic,
                meaning: "damping of the bristles before they slide",
            },
        ],
        shapes: &[
            Parameter {
                name: "stroke",
                unit: "rad",
                bounds: [f64::MIN_POSITIVE, f64::INFINITY],
                range: [2.0e-4, 0.1],
                scale: Scale::Logarithmic,
                meaning: "displacement over which friction builds up to 63 %",
            },
            Parameter {
                name: "breakaway",
                unit: "1",
                bounds: [0.0, 10.0],
                range: [0.0, 1.0],
                scale: Scale::Linear,
                meaning: "breakaway over Coulomb friction, less one",
            },
            Parameter {
                name: "velocity",
                unit: "rad/s",
                bounds: [f64::MIN_POSITIVE, f64::INFINITY],
                range: [0.005, 2.0],
                scale: Scale::Logarithmic,
                meaning: "Stribeck velocity",
            },
        ],
        signature: "after each reversal friction builds up over a distance and then falls with the speed",
        confused: &[
            Confusion {
                with: "stribeck",
                exact: false,
                separated_by: "constant speeds from 0.005 to 1 rad/s, both ways",
            },
            Confusion {
                with: "backlash",
                exact: false,
                separated_by: "reversals at q = 90 degrees, where gravity closes a gap",
            },
            Confusion {
                with: "joint_elasticity",
                exact: false,
                separated_by: "reversals without load and with load; a second encoder on the link",
            },
        ],
        needs: &[Need::Reversals(8), Need::SlowMotion(0.05)],
        compensable: true,
        leaves_out: "memory of inner loops beyond the last reversal; with much micro-damping the law is not passive",
    };

    #[inline(always)]
    fn terms<T: Real>(
        shapes: &[T; SHAPES],
        memory: &mut [T; MEMORY],
        at: &Instant<T>,
    ) -> [T; GAINS] {
        // Exact along a travel at constant velocity, so that any step is stable.
        let travel = at.travel;
        let (sign, ratio) = (travel.sgn(), at.friction_ratio());
        let level = T::ONE + shapes[1] * (-(at.velocity / shapes[2]).squared()).exp();
        let kept = (-(travel.abs() / (shapes[0] * level * ratio))).exp();
        let goal = sign * level * ratio;
        memory[0] = sign.squared() * (goal + (memory[0] - goal) * kept)
            + (T::ONE - sign.squared()) * memory[0];
        let share = memory[0] / ratio;
        let bristle = at.velocity - at.velocity.abs() * share / level;
        [share - at.direction, bristle, T::ZERO, T::ZERO]
    }
}
