//! Reading of the current sensor at zero current.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct CurrentOffset;

impl Law for CurrentOffset {
    const ABOUT: About = About {
        name: "current_offset",
        law: None,
        title: "offset of the current sensor",
        equation: "torque read = torque + offset",
        source: "Chung and Sul 1998",
        channel: Channel::Effort,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "offset",
            unit: "N*m",
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
            range: [0.02, 1.0],
            scale: Scale::Logarithmic,
            meaning: "current read at rest with the drive off, times torque constant and ratio",
        }],
        shapes: &[],
        signature: "constant, in motion and at rest, with the drive on and off",
        confused: &[
            Confusion {
                with: "asymmetric_coulomb",
                exact: true,
                separated_by: "a recording with the drive off, or of the voltage",
            },
            Confusion {
                with: "torque_offset",
                exact: true,
                separated_by: "a recording with the drive off, or of the voltage",
            },
        ],
        needs: &[Need::Prior],
        compensable: false,
        leaves_out: "drift with temperature, an offset of one phase (torque ripple at one period per electrical turn)",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], _: &Instant<T>) -> [T; GAINS] {
        [T::ONE, T::ZERO, T::ZERO, T::ZERO]
    }
}
