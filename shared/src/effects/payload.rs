//! A mass on the link. Inertia and gravity are not two independent gains: both follow from mass and distance.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct Payload;

impl Law for Payload {
    const ABOUT: About = About {
        name: "payload",
        law: None,
        title: "payload on the link",
        equation: "mass · distance · (distance · q̈ + g(q)), g(q): torque of gravity per kg·m along the link's x axis",
        source: "Khalil, Gautier, Lemoine 2007",
        channel: Channel::Load,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "mass",
            unit: "kg",
            bounds: [0.0, f64::INFINITY],
            range: [0.02, 5.0],
            scale: Scale::Logarithmic,
            meaning: "of the payload, a point",
        }],
        shapes: &[Parameter {
            name: "distance",
            unit: "m",
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
            range: [0.05, 1.0],
            scale: Scale::Linear,
            meaning: "along x of the link's frame",
        }],
        signature: "inertia and gravity grow in the ratio that a mass at one place gives; nothing is left after a refit",
        confused: &[
            Confusion {
                with: "gravity_tilt",
                exact: false,
                separated_by: "fast motion: a tilt adds no inertia",
            },
            Confusion {
                with: "inertia_coupling",
                exact: false,
                separated_by: "one joint moved at a time",
            },
        ],
        needs: &[Need::Prior],
        compensable: true,
        leaves_out: "its own inertia, a place off the link's x axis; for several joints the description's link takes it",
    };

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        let arm = shapes[0];
        [
            arm * (arm * at.acceleration + at.gravity),
            T::ZERO,
            T::ZERO,
            T::ZERO,
        ]
    }
}
