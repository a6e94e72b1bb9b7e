//! A code disc or magnet off the motor's axis.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Periodic, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES, wave};
use crate::scalar::Real;

pub(super) struct EncoderEccentricityMotor;

const COSINE: Parameter = Parameter {
    name: "cosine",
    unit: "rad",
    bounds: [f64::NEG_INFINITY, f64::INFINITY],
    range: [1.0e-5, 1.0e-3],
    scale: Scale::Logarithmic,
    meaning: "joint-side amplitude of the part with cos",
};

impl Law for EncoderEccentricityMotor {
    const ABOUT: About = About {
        name: "encoder_eccentricity",
        law: Some("motor"),
        title: "eccentricity of the encoder on the motor",
        equation: "q read = q + cosine · cos(order·θm) + sine · sin(order·θm)",
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
            range: [1.0, 2.0],
            scale: Scale::Whole,
            meaning: "periods per turn of the motor, a whole number",
        }],
        signature: "periodic with each turn of the motor, growing with the square of the speed",
        confused: &[
            Confusion {
                with: "gear_eccentricity",
                exact: false,
                separated_by: "fast and slow motion: a torque does not grow with the speed",
            },
            Confusion {
                with: "cogging",
                exact: false,
                separated_by: "fast and slow motion: a torque does not grow with the speed",
            },
        ],
        needs: &[Need::SlowTurns(20.0), Need::SpeedRange(3.0)],
        compensable: false,
        leaves_out: "interpolation errors within a line of the code disc",
    };
    const PERIODIC: Option<Periodic> = Some(Periodic::Motor);

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        wave(shapes[0], at.motor_angle)
    }
}
