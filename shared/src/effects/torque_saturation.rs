//! A torque constant that falls at high current.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct TorqueSaturation;

impl Law for TorqueSaturation {
    const ABOUT: About = About {
        name: "torque_saturation",
        law: None,
        title: "saturation of the motor",
        equation: "coefficient · (drive torque)³; with Kt(1 − b·i²), b = coefficient · (Kt·ratio)²",
        source: "Krishnan 2010: the armature's field saturates the iron",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "coefficient",
            unit: "1/(N*m)^2",
            bounds: [0.0, f64::INFINITY],
            range: [1.0e-5, 2.0e-3],
            scale: Scale::Logarithmic,
            meaning: "relative loss of the torque constant per square of the torque that the current would give",
        }],
        shapes: &[],
        signature: "odd and cubic in the current, nothing at low current",
        confused: &[
            Confusion {
                with: "load_friction",
                exact: false,
                separated_by: "slow motion under high load in both directions",
            },
            Confusion {
                with: "quadratic_drag",
                exact: false,
                separated_by: "constant high speeds, where no acceleration asks for current",
            },
            Confusion {
                with: "viscous_warmup",
                exact: false,
                separated_by: "the same motion cold and warm",
            },
        ],
        needs: &[Need::LoadRange(2.0)],
        compensable: true,
        leaves_out: "powers of the current beyond the third, the fall of inductance and back-EMF",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        [
            at.drive_torque * at.drive_torque.squared(),
            T::ZERO,
            T::ZERO,
            T::ZERO,
        ]
    }
}
