//! Torque of gear teeth whose lever arm varies over a turn.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Periodic, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES, wave};
use crate::scalar::Real;

pub(super) struct GearEccentricity;

const COSINE: Parameter = Parameter {
    name: "cosine",
    unit: "N*m",
    bounds: [f64::NEG_INFINITY, f64::INFINITY],
    range: [0.02, 0.5],
    scale: Scale::Logarithmic,
    meaning: "joint-side amplitude of the part with cos",
};

impl Law for GearEccentricity {
    const ABOUT: About = About {
        name: "gear_eccentricity",
        law: None,
        title: "eccentricity of the gear",
        equation: "cosine · cos(order·θm) + sine · sin(order·θm)",
        source: "Tuttle 1992; Ghorbel, Gandhi, Alpeter 2001",
        channel: Channel::Torque,
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
            bounds: [f64::MIN_POSITIVE, f64::INFINITY],
            range: [1.0, 3.0],
            scale: Scale::Whole,
            meaning: "periods per turn of the motor; 1 for the stage on its shaft, below 1 for later stages",
        }],
        signature: "periodic with each turn of the motor, the same at any current",
        confused: &[
            Confusion {
                with: "cogging",
                exact: false,
                separated_by: "its order is the number of poles and slots, not 1 or 2",
            },
            Confusion {
                with: "torque_ripple",
                exact: false,
                separated_by: "the same slow speed under two loads",
            },
            Confusion {
                with: "encoder_eccentricity",
                exact: false,
                separated_by: "fast and slow motion: the encoder's error shows with the square of the speed",
            },
            Confusion {
                with: "gravity_tilt",
                exact: false,
                separated_by: "at one period per turn of the joint the two are the same; turn the link on its shaft",
            },
        ],
        needs: &[Need::SlowTurns(20.0)],
        compensable: true,
        leaves_out: "the error of the joint's angle that comes with it, amplitudes that grow with the load",
    };
    const PERIODIC: Option<Periodic> = Some(Periodic::Motor);

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        wave(shapes[0], at.motor_angle)
    }
}
