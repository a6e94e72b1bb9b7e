//! Friction of teeth and bearings that grows with the load.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct LoadFriction;

impl Law for LoadFriction {
    const OPTIONAL: &'static [&'static str] = &["link_friction"];
    const ABOUT: About = About {
        name: "load_friction",
        law: None,
        title: "friction that grows with the load",
        equation: "coefficient · |load + link_friction · friction| · sgn q̇",
        source: "Hamon, Gautier, Garrec 2010; Bittencourt and Gunnarsson 2012",
        channel: Channel::Torque,
        direction: Direction::Dry,
        gains: &[Parameter {
            name: "coefficient",
            unit: "1",
            bounds: [0.0, 1.0],
            range: [0.02, 0.3],
            scale: Scale::Logarithmic,
            meaning: "friction per transmitted torque",
        }],
        shapes: &[Parameter {
            name: "link_friction",
            unit: "1",
            bounds: [0.0, 1.0],
            range: [0.0, 1.0],
            scale: Scale::Linear,
            meaning: "share of the joint's friction that acts on the link's side of the gear, which carries it as well",
        }],
        signature: "odd in velocity and proportional to the transmitted torque, whatever its sign; with friction on the link also more where the motor drives the load than where the load drives the motor",
        confused: &[
            Confusion {
                with: "position_friction",
                exact: false,
                separated_by: "the same speed with two payloads, or with the base turned so that gravity does nothing",
            },
            Confusion {
                with: "torque_ripple",
                exact: false,
                separated_by: "speeds in both directions at one load",
            },
            Confusion {
                with: "torque_saturation",
                exact: false,
                separated_by: "slow motion under high load in both directions",
            },
        ],
        needs: &[Need::LoadRange(1.0), Need::Reversals(4)],
        compensable: true,
        leaves_out: "a term with the square of the load; what other effects add to the friction on the link's side",
    };

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        let carried = at.load + shapes[0] * at.friction;
        [carried.abs() * at.direction, T::ZERO, T::ZERO, T::ZERO]
    }
}
