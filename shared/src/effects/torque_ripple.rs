//! A torque constant that varies with the motor's angle.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Periodic, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES, wave};
use crate::scalar::Real;

pub(super) struct TorqueRipple;

const COSINE: Parameter = Parameter {
    name: "cosine",
    unit: "1",
    bounds: [f64::NEG_INFINITY, f64::INFINITY],
    range: [0.005, 0.1],
    scale: Scale::Logarithmic,
    meaning: "relative loss of the torque constant, the part with cos",
};

impl Law for TorqueRipple {
    const ABOUT: About = About {
        name: "torque_ripple",
        law: None,
        title: "torque ripple",
        equation: "drive torque · (cosine · cos(order·θm) + sine · sin(order·θm))",
        source: "Holtz and Springob 1996",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[
            COSINE,
            Parameter {
                name: "sine",
                meaning: "relative loss of the torque constant, the part with sin",
                ..COSINE
            },
        ],
        shapes: &[Parameter {
            name: "order",
            unit: "1",
            bounds: [1.0, f64::INFINITY],
            range: [1.0, 84.0],
            scale: Scale::Whole,
            meaning: "periods per turn of the motor, a whole number; 6 times the pole pairs from the back-EMF, 1 and 2 times from the current sensors",
        }],
        signature: "periodic in the motor's angle, proportional to the current",
        confused: &[
            Confusion {
                with: "cogging",
                exact: false,
                separated_by: "the same slow speed under two loads",
            },
            Confusion {
                with: "gear_eccentricity",
                exact: false,
                separated_by: "the same slow speed under two loads",
            },
            Confusion {
                with: "load_friction",
                exact: false,
                separated_by: "speeds in both directions at one load",
            },
        ],
        needs: &[Need::SlowTurns(20.0), Need::LoadRange(1.0)],
        compensable: true,
        leaves_out: "the field-weakening range, higher harmonics of the order",
    };
    const PERIODIC: Option<Periodic> = Some(Periodic::MotorTimesDrive);

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        let [cosine, sine, ..] = wave(shapes[0], at.motor_angle);
        [
            at.drive_torque * cosine,
            at.drive_torque * sine,
            T::ZERO,
            T::ZERO,
        ]
    }
}
