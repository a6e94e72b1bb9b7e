//! Detent torque of the motor's magnets.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Periodic, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES, wave};
use crate::scalar::Real;

pub(super) struct Cogging;

const AMPLITUDE: Parameter = Parameter {
    name: "cosine",
    unit: "N*m",
    bounds: [f64::NEG_INFINITY, f64::INFINITY],
    range: [0.02, 0.5],
    scale: Scale::Logarithmic,
    meaning: "joint-side amplitude of the part with cos",
};

impl Law for Cogging {
    const ABOUT: About = About {
        name: "cogging",
        law: None,
        title: "cogging of the motor",
        equation: "cosine · cos(order·θm) + sine · sin(order·θm)",
        source: "Holtz and Springob 1996",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[
            AMPLITUDE,
            Parameter {
                name: "sine",
                meaning: "joint-side amplitude of the part with sin",
                ..AMPLITUDE
            },
        ],
        shapes: &[Parameter {
            name: "order",
            unit: "1",
            bounds: [2.0, f64::INFINITY],
            range: [4.0, 84.0],
            scale: Scale::Whole,
            meaning: "periods per turn of the motor, a whole number",
        }],
        signature: "periodic in the motor's angle, the same at any current",
        confused: &[Confusion {
            with: "torque_ripple",
            exact: false,
            separated_by: "the same slow speed under two loads",
        }],
        needs: &[Need::SlowTurns(20.0)],
        compensable: true,
        leaves_out: "higher harmonics of the order",
    };
    const PERIODIC: Option<Periodic> = Some(Periodic::Motor);

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        wave(shapes[0], at.motor_angle)
    }
}
