//! A shaft or gear that twists under load. Its torque is [`transmission_torque`](super::transmission_torque) without a
//! gap.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct JointElasticity;

impl Law for JointElasticity {
    const ABOUT: About = About {
        name: "joint_elasticity",
        law: None,
        title: "elasticity of the joint",
        equation: "torque = stiffness · twist + damping · d(twist)/dt, twist = θm/ratio − q",
        source: "Spong 1987; De Luca and Book 2016",
        channel: Channel::Transmission,
        direction: Direction::Indifferent,
        gains: &[],
        shapes: &[
            Parameter {
                name: "stiffness",
                unit: "N*m/rad",
                bounds: [f64::MIN_POSITIVE, f64::INFINITY],
                range: [200.0, 2.0e4],
                scale: Scale::Logarithmic,
                meaning: "torque per twist",
            },
            Parameter {
                name: "damping",
                unit: "N*m*s/rad",
                bounds: [0.0, f64::INFINITY],
                range: [0.1, 50.0],
                scale: Scale::Logarithmic,
                meaning: "torque per rate of twist",
            },
            Parameter {
                name: "link_friction",
                unit: "1",
                bounds: [0.0, 1.0],
                range: [0.0, 1.0],
                scale: Scale::Linear,
                meaning: "share of the joint's friction that acts on the link's side of the gear",
            },
        ],
        signature: "resonance between motor and link, growing with the second derivative of the load",
        confused: &[
            Confusion {
                with: "measurement_delay",
                exact: false,
                separated_by: "a chirp beyond the antiresonance; below it both show alike",
            },
            Confusion {
                with: "presliding",
                exact: false,
                separated_by: "reversals without load and with load; a second encoder on the link",
            },
            Confusion {
                with: "backlash",
                exact: false,
                separated_by: "small motion at q = 90 degrees, where gravity closes a gap",
            },
        ],
        needs: &[Need::Reversals(4)],
        compensable: false,
        leaves_out: "stiffness that grows with the twist, hysteresis of the windings, modes of the link itself",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], _: &Instant<T>) -> [T; GAINS] {
        [T::ZERO; GAINS]
    }
}
