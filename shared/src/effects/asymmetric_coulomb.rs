//! Friction that differs with the direction.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct AsymmetricCoulomb;

impl Law for AsymmetricCoulomb {
    const ABOUT: About = About {
        name: "asymmetric_coulomb",
        law: None,
        title: "Coulomb friction that differs with the direction",
        equation: "asymmetry · (sgn q̇)²",
        source: "Armstrong-Hélouvry, Dupont, Canudas de Wit 1994",
        channel: Channel::Torque,
        direction: Direction::Dry,
        gains: &[Parameter {
            name: "asymmetry",
            unit: "N*m",
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
            range: [0.01, 0.5],
            scale: Scale::Logarithmic,
            meaning: "half the difference of Coulomb friction between the two directions",
        }],
        shapes: &[],
        signature: "constant while moving, the same in both directions",
        confused: &[
            Confusion {
                with: "current_offset",
                exact: true,
                separated_by: "a recording with the drive off, or of the voltage",
            },
            Confusion {
                with: "torque_offset",
                exact: true,
                separated_by: "the same motion with what pulls on the joint taken off, for a torque from outside; no motion alone",
            },
        ],
        needs: &[Need::Reversals(2)],
        compensable: true,
        leaves_out: "a difference of the viscous friction",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        [at.direction.squared(), T::ZERO, T::ZERO, T::ZERO]
    }
}
