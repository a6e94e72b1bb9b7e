//! A direction of gravity that differs from the description: the change of torque of one joint.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct GravityTilt;

const COSINE: Parameter = Parameter {
    name: "cosine",
    unit: "N*m",
    bounds: [f64::NEG_INFINITY, f64::INFINITY],
    range: [0.02, 2.0],
    scale: Scale::Logarithmic,
    meaning: "change of gravity's torque, the part with cos",
};

impl Law for GravityTilt {
    const ABOUT: About = About {
        name: "gravity_tilt",
        law: None,
        title: "tilt of the base",
        equation: "cosine · cos q + sine · sin q",
        source: "Khalil and Dombre 2002, chap. 9: gravity's part of one joint",
        channel: Channel::Load,
        direction: Direction::Indifferent,
        gains: &[
            COSINE,
            Parameter {
                name: "sine",
                meaning: "change of gravity's torque, the part with sin",
                ..COSINE
            },
        ],
        shapes: &[],
        signature: "one period per turn of the joint, the same at any speed; nothing is left after a refit of both first moments",
        confused: &[
            Confusion {
                with: "spring",
                exact: false,
                separated_by: "more than two thirds of a turn, or the cable taken off",
            },
            Confusion {
                with: "encoder_eccentricity",
                exact: false,
                separated_by: "fast and slow motion, or the base turned by 180 degrees",
            },
            Confusion {
                with: "gear_eccentricity",
                exact: false,
                separated_by: "at one period per turn of the joint the two are the same; turn the link on its shaft",
            },
            Confusion {
                with: "payload",
                exact: false,
                separated_by: "fast motion: a payload adds inertia in proportion",
            },
        ],
        needs: &[Need::Prior, Need::Travel(0.25)],
        compensable: true,
        leaves_out: "an encoder's zero and a centre of mass off its line, which are the same function of one joint; for several joints two angles tilt gravity itself",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        let (sine, cosine) = at.position.sin_cos();
        [cosine, sine, T::ZERO, T::ZERO]
    }
}
