//! Tight spots of seals, bearings and a bent shaft.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES, wave};
use crate::scalar::Real;

pub(super) struct PositionFriction;

const COSINE: Parameter = Parameter {
    name: "cosine",
    unit: "N*m",
    bounds: [f64::NEG_INFINITY, f64::INFINITY],
    range: [0.02, 0.5],
    scale: Scale::Logarithmic,
    meaning: "amplitude of the part with cos",
};

impl Law for PositionFriction {
    const ABOUT: About = About {
        name: "position_friction",
        law: None,
        title: "friction that varies with the position",
        equation: "(cosine · cos(order·q) + sine · sin(order·q)) · sgn q̇",
        source: "Bittencourt and Gunnarsson 2012",
        channel: Channel::Torque,
        direction: Direction::Dry,
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
        signature: "odd in velocity, periodic in the joint's position, the same at every speed and load",
        confused: &[
            Confusion {
                with: "load_friction",
                exact: false,
                separated_by: "two payloads, or the base turned so that gravity does nothing",
            },
            Confusion {
                with: "asymmetric_coulomb",
                exact: false,
                separated_by: "more than half a turn of the joint",
            },
        ],
        needs: &[Need::Travel(0.7), Need::Reversals(4)],
        compensable: true,
        leaves_out: "viscous friction that varies with the position, harmonics",
    };

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        let [cosine, sine, ..] = wave(shapes[0], at.position);
        [cosine * at.direction, sine * at.direction, T::ZERO, T::ZERO]
    }
}
