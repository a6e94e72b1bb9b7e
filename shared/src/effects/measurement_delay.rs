//! A torque or current reading that is delayed against the position.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct MeasurementDelay;

impl Law for MeasurementDelay {
    const ABOUT: About = About {
        name: "measurement_delay",
        law: None,
        title: "delay of the torque or current reading",
        equation: "torque read at t = torque at t − delay; to first order −delay · d(torque)/dt",
        source: "Taylor series of a pure delay",
        channel: Channel::Effort,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "delay",
            unit: "s",
            bounds: [0.0, 1.0],
            range: [2.0e-4, 0.01],
            scale: Scale::Logarithmic,
            meaning: "how much later the torque is read than the position",
        }],
        shapes: &[],
        signature: "proportional to the rate of the torque",
        confused: &[
            Confusion {
                with: "joint_elasticity",
                exact: false,
                separated_by: "a chirp beyond the antiresonance; below it both show alike",
            },
            Confusion {
                with: "inertia_coupling",
                exact: false,
                separated_by: "one joint moved at a time",
            },
        ],
        needs: &[Need::SpeedRange(2.0)],
        compensable: false,
        leaves_out: "a delay of the position: the difference of the two is all that shows; terms of second order in delay times frequency",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        [-at.drive_rate, T::ZERO, T::ZERO, T::ZERO]
    }
}
