//! Viscous friction that falls with running time.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct ViscousWarmupTime;

impl Law for ViscousWarmupTime {
    const ABOUT: About = About {
        name: "viscous_warmup",
        law: Some("time"),
        title: "viscous friction that falls as the joint runs",
        equation: "−drop · q̇ · (1 − exp(−t/time_constant))",
        source: "Bittencourt and Gunnarsson 2012; Simoni and others 2015",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "drop",
            unit: "N*m*s/rad",
            bounds: [0.0, f64::INFINITY],
            range: [0.01, 2.0],
            scale: Scale::Logarithmic,
            meaning: "viscous friction cold less warm",
        }],
        shapes: &[Parameter {
            name: "time_constant",
            unit: "s",
            bounds: [f64::MIN_POSITIVE, f64::INFINITY],
            range: [10.0, 3600.0],
            scale: Scale::Logarithmic,
            meaning: "running time after which 63 % of the fall has happened",
        }],
        signature: "odd in velocity, growing with it, fading over minutes",
        confused: &[
            Confusion {
                with: "quadratic_drag",
                exact: false,
                separated_by: "the same speeds in random order",
            },
            Confusion {
                with: "torque_saturation",
                exact: false,
                separated_by: "the same motion cold and warm",
            },
        ],
        needs: &[Need::Duration(60.0)],
        compensable: true,
        leaves_out: "cooling in pauses, Coulomb friction that falls with temperature too, what happened before the recording",
    };

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        let warm = T::ONE - (-(at.time / shapes[0])).exp();
        [-(at.velocity * warm), T::ZERO, T::ZERO, T::ZERO]
    }
}
