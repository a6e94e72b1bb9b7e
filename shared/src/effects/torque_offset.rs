//! Preload of a cable, a seal or a counterbalance.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct TorqueOffset;

impl Law for TorqueOffset {
    const ABOUT: About = About {
        name: "torque_offset",
        law: None,
        title: "constant torque",
        equation: "offset",
        source: "Janot, Gautier, Brunot 2019, the offset of their model",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "offset",
            unit: "N*m",
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
            range: [0.02, 1.0],
            scale: Scale::Logarithmic,
            meaning: "constant torque that the drive has to give",
        }],
        shapes: &[],
        signature: "constant, in motion and at rest; gone with the drive off",
        confused: &[
            Confusion {
                with: "asymmetric_coulomb",
                exact: true,
                separated_by: "the same motion with what pulls on the joint taken off, for a torque from outside; no motion alone",
            },
            Confusion {
                with: "current_offset",
                exact: true,
                separated_by: "a recording with the drive off, or of the voltage",
            },
        ],
        needs: &[Need::Prior],
        compensable: true,
        leaves_out: "where it comes from",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], _: &Instant<T>) -> [T; GAINS] {
        [T::ONE, T::ZERO, T::ZERO, T::ZERO]
    }
}
