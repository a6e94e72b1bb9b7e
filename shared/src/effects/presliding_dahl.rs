//! Presliding friction (memory of distance), Dahl's law.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct PreslidingDahl;

impl Law for PreslidingDahl {
    const ABOUT: About = About {
        name: "presliding",
        law: Some("dahl"),
        title: "presliding friction",
        equation: "coulomb · (z − sgn q̇), dz/dq = (1 − z·sgn q̇)/stroke",
        source: "Dahl 1968, exponent 1",
        channel: Channel::Torque,
        direction: Direction::Dry,
        gains: &[Parameter {
            name: "coulomb",
            unit: "N*m",
            bounds: [0.0, f64::INFINITY],
            range: [0.05, 2.0],
            scale: Scale::Logarithmic,
            meaning: "the part of the joint's Coulomb friction that builds up over the stroke",
        }],
        shapes: &[Parameter {
            name: "stroke",
            unit: "rad",
            bounds: [f64::MIN_POSITIVE, f64::INFINITY],
            range: [2.0e-4, 0.1],
            scale: Scale::Logarithmic,
            meaning: "displacement over which friction builds up to 63 %",
        }],
        signature: "after each reversal friction builds up over a distance, at any speed",
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
        ],
        needs: &[Need::Reversals(8)],
        compensable: true,
        leaves_out: "memory of inner loops beyond the last reversal",
    };

    #[inline(always)]
    fn terms<T: Real>(
        shapes: &[T; SHAPES],
        memory: &mut [T; MEMORY],
        at: &Instant<T>,
    ) -> [T; GAINS] {
        // Exact along a travel in one direction, so that any step is stable.
        let travel = at.travel;
        let (sign, ratio) = (travel.sgn(), at.friction_ratio());
        let kept = (-(travel.abs() / (shapes[0] * ratio))).exp();
        let goal = sign * ratio;
        memory[0] = sign.squared() * (goal + (memory[0] - goal) * kept)
            + (T::ONE - sign.squared()) * memory[0];
        [memory[0] / ratio - at.direction, T::ZERO, T::ZERO, T::ZERO]
    }
}
