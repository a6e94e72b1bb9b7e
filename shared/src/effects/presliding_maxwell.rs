//! Presliding friction: elastic elements that slip one after the other.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct PreslidingMaxwell;

const ELEMENT: Parameter = Parameter {
    name: "element_1",
    unit: "N*m",
    bounds: [0.0, f64::INFINITY],
    range: [0.01, 1.0],
    scale: Scale::Logarithmic,
    meaning: "friction of the element that yields at an eighth of the stroke",
};

impl Law for PreslidingMaxwell {
    const ABOUT: About = About {
        name: "presliding",
        law: Some("maxwell"),
        title: "presliding friction",
        equation: "Σ element_k · (s_k − sgn q̇), s_k = clamp(s_k + dq/(stroke·2^(k−4)), −1, 1)",
        source: "Al-Bender, Lampaert, Swevers 2005, without its sliding dynamics; Iwan 1966",
        channel: Channel::Torque,
        direction: Direction::Dry,
        gains: &[
            ELEMENT,
            Parameter {
                name: "element_2",
                meaning: "friction of the element that yields at a quarter of the stroke",
                ..ELEMENT
            },
            Parameter {
                name: "element_3",
                meaning: "friction of the element that yields at half of the stroke",
                ..ELEMENT
            },
            Parameter {
                name: "element_4",
                meaning: "friction of the element that yields at the stroke",
                ..ELEMENT
            },
        ],
        shapes: &[Parameter {
            name: "stroke",
            unit: "rad",
            bounds: [f64::MIN_POSITIVE, f64::INFINITY],
            range: [5.0e-4, 0.2],
            scale: Scale::Logarithmic,
            meaning: "displacement at which the last element yields, from rest",
        }],
        signature: "after each reversal friction builds up over a distance, at any speed; inner loops close",
        confused: &[
            Confusion {
                with: "stribeck",
                exact: false,
                separated_by: "constant speeds from 0.005 to 1 rad/s, both ways",
            },
            Confusion {
                with: "backlash",
                exact: false,
                separated_by: "reversals at q = 90 degrees, where gravity closes a gap",
            },
            Confusion {
                with: "joint_elasticity",
                exact: false,
                separated_by: "reversals without load and with load; a second encoder on the link",
            },
        ],
        needs: &[Need::Reversals(8)],
        compensable: true,
        leaves_out: "frictional lag; yield displacements other than those four",
    };

    #[inline(always)]
    fn terms<T: Real>(
        shapes: &[T; SHAPES],
        memory: &mut [T; MEMORY],
        at: &Instant<T>,
    ) -> [T; GAINS] {
        let (travel, ratio) = (at.travel, at.friction_ratio());
        let mut yield_at = shapes[0];
        let mut terms = [T::ZERO; GAINS];
        for (state, term) in memory.iter_mut().zip(&mut terms).rev() {
            *state = (*state + travel / yield_at).clamp_to(-ratio, ratio);
            *term = *state / ratio - at.direction;
            yield_at *= T::from_f64(0.5);
        }
        terms
    }
}
