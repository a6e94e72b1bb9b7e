//! Viscous friction that falls with a measured temperature.

use super::about::{About, Channel, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use super::viscous_warmup_time::ViscousWarmupTime;
use crate::scalar::Real;

pub(super) struct ViscousWarmupTemperature;

impl Law for ViscousWarmupTemperature {
    const ABOUT: About = About {
        name: "viscous_warmup",
        law: Some("temperature"),
        title: "viscous friction that falls with temperature",
        equation: "−coefficient · ΔT · q̇",
        source: "Bittencourt and Gunnarsson 2012, linearised",
        channel: Channel::Torque,
        direction: Direction::Indifferent,
        gains: &[Parameter {
            name: "coefficient",
            unit: "N*m*s/(rad*K)",
            bounds: [0.0, f64::INFINITY],
            range: [5.0e-4, 0.05],
            scale: Scale::Logarithmic,
            meaning: "fall of viscous friction per kelvin above the temperature at the start",
        }],
        shapes: &[],
        signature: "odd in velocity, growing with it, fading as the temperature rises",
        confused: ViscousWarmupTime::ABOUT.confused,
        needs: &[Need::Temperature],
        compensable: true,
        leaves_out: "the curve of viscosity over more than some 20 K, Coulomb friction that falls with temperature too",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        [
            -(at.velocity * at.temperature_rise),
            T::ZERO,
            T::ZERO,
            T::ZERO,
        ]
    }
}
