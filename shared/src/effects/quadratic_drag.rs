//! Drag of air and churning grease.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct QuadraticDrag;

impl Law for QuadraticDrag {
    const ABOUT: About = About {
        name: "quadratic_drag",
        law: None,
        title: "quadratic drag",
        equation: "coefficient · q̇ · |q̇|",
        source: "Newton's law of drag",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "coefficient",
            unit: "N*m*s^2/rad^2",
            bounds: [0.0, f64::INFINITY],
            range: [1.0e-3, 0.2],
            scale: Scale::Logarithmic,
            meaning: "torque at 1 rad/s, with the square of the speed",
        }],
        shapes: &[],
        signature: "odd in velocity, growing at high speed only, the same at every position",
        confused: &[
            Confusion {
                with: "torque_saturation",
                exact: false,
                separated_by: "constant high speeds, where no acceleration asks for current",
            },
            Confusion {
                with: "viscous_warmup",
                exact: false,
                separated_by: "the same speeds in random order",
            },
        ],
        needs: &[Need::SpeedRange(3.0)],
        compensable: true,
        leaves_out: "lift, wakes, a power of the speed other than two",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        [at.velocity * at.velocity.abs(), T::ZERO, T::ZERO, T::ZERO]
    }
}
