//! A code disc or magnet off the joint's axis.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Periodic, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES, wave};
use crate::scalar::Real;

pub(super) struct EncoderEccentricityJoint;

const COSINE: Parameter = Parameter {
    name: "cosine",
    unit: "rad",
    bounds: [f64::NEG_INFINITY, f64::INFINITY],
    range: [3.0e-4, 0.02],
    scale: Scale::Logarithmic,
    meaning: "amplitude of the part with cos",
};

impl Law for EncoderEccentricityJoint {
    const ABOUT: About = About {
        name: "encoder_eccentricity",
        law: Some("joint"),
        title: "eccentricity of the encoder on the joint",
        equation: "q read = q + cosine · cos(order·q) + sine · sin(order·q)",
        source: "Ellin and Dolsak 2008",
        channel: Channel::Position,
        direction: Direction::Indifferent,
        gains: &[
            COSINE,
            Parameter {
                name: "sine",
                meaning: "amplitude of the part with sin",
                ..COSINE
            },
        ],
        shapes: &[Parameter {
            name: "order",
            unit: "1",
            bounds: [1.0, f64::INFINITY],
            range: [1.0, 4.0],
            scale: Scale::Whole,
            meaning: "periods per turn of the joint, a whole number",
        }],
        signature: "periodic with each turn of the joint, growing with the square of the speed",
        confused: &[
            Confusion {
                with: "gravity_tilt",
                exact: false,
                separated_by: "fast and slow motion, or the base turned by 180 degrees",
            },
            Confusion {
                with: "spring",
                exact: false,
                separated_by: "fast and slow motion",
            },
        ],
        needs: &[Need::Travel(0.7), Need::SpeedRange(3.0)],
        compensable: false,
        leaves_out: "interpolation errors within a line of the code disc",
    };
    const PERIODIC: Option<Periodic> = Some(Periodic::Joint);

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        wave(shapes[0], at.position)
    }
}
