//! A cable or hose that pulls the joint back.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct Spring;

impl Law for Spring {
    const ABOUT: About = About {
        name: "spring",
        law: None,
        title: "spring of a cable or hose",
        equation: "stiffness · q + preload, at rest at q = −preload/stiffness",
        source: "Hooke's law",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[
            Parameter {
                name: "stiffness",
                unit: "N*m/rad",
                bounds: [0.0, f64::INFINITY],
                range: [0.02, 5.0],
                scale: Scale::Logarithmic,
                meaning: "torque per position",
            },
            Parameter {
                name: "preload",
                unit: "N*m",
                bounds: [f64::NEG_INFINITY, f64::INFINITY],
                range: [0.01, 2.0],
                scale: Scale::Logarithmic,
                meaning: "torque at q = 0",
            },
        ],
        shapes: &[],
        signature: "linear in position, the same at any speed",
        confused: &[
            Confusion {
                with: "gravity_tilt",
                exact: false,
                separated_by: "more than two thirds of a turn, or the cable taken off",
            },
            Confusion {
                with: "encoder_eccentricity",
                exact: false,
                separated_by: "fast and slow motion",
            },
            Confusion {
                with: "torque_offset",
                exact: false,
                separated_by: "the preload alone is one",
            },
        ],
        needs: &[Need::Travel(0.5)],
        compensable: true,
        leaves_out: "hysteresis of the cable, stiffness that grows with the stretch",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        [at.position, T::ONE, T::ZERO, T::ZERO]
    }
}
