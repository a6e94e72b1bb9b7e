//! Terms of another joint's motion: a coupled gear train, or a rotor that another joint moves.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct InertiaCoupling;

impl Law for InertiaCoupling {
    const ABOUT: About = About {
        name: "inertia_coupling",
        law: None,
        title: "coupling to another joint",
        equation: "inertia · q̈ₒ + centripetal · q̇ₒ² + viscous · q̇ₒ, ₒ: the other joint",
        source: "Khalil and Dombre 2002, chap. 9",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[
            Parameter {
                name: "inertia",
                unit: "kg*m^2",
                bounds: [f64::NEG_INFINITY, f64::INFINITY],
                range: [1.0e-3, 5.0],
                scale: Scale::Logarithmic,
                meaning: "torque per acceleration of the other joint",
            },
            Parameter {
                name: "centripetal",
                unit: "kg*m^2",
                bounds: [f64::NEG_INFINITY, f64::INFINITY],
                range: [1.0e-3, 5.0],
                scale: Scale::Logarithmic,
                meaning: "torque per square of the other joint's velocity",
            },
            Parameter {
                name: "viscous",
                unit: "N*m*s/rad",
                bounds: [f64::NEG_INFINITY, f64::INFINITY],
                range: [1.0e-2, 5.0],
                scale: Scale::Logarithmic,
                meaning: "torque per velocity of the other joint",
            },
        ],
        shapes: &[],
        signature: "depends on another joint's velocity and acceleration, gone while that one rests",
        confused: &[
            Confusion {
                with: "measurement_delay",
                exact: false,
                separated_by: "one joint moved at a time",
            },
            Confusion {
                with: "payload",
                exact: false,
                separated_by: "one joint moved at a time",
            },
        ],
        needs: &[Need::OtherJoint],
        compensable: false,
        leaves_out: "coefficients that vary with the position, dry friction of a coupled gear, the reaction on the other joint unless it is stated too",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        [at.other[2], at.other[1].squared(), at.other[1], T::ZERO]
    }
}
