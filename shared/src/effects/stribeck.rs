//! Friction that falls as the joint starts to slide.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct Stribeck;

impl Law for Stribeck {
    const ABOUT: About = About {
        name: "stribeck",
        law: None,
        title: "Stribeck friction",
        equation: "breakaway · exp(−(q̇/velocity)²) · sgn q̇",
        source: "Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, sec. 2.1, Gaussian exponent",
        channel: Channel::Torque,
        direction: Direction::Dry,
        gains: &[Parameter {
            name: "breakaway",
            unit: "N*m",
            bounds: [0.0, f64::INFINITY],
            range: [0.01, 1.0],
            scale: Scale::Logarithmic,
            meaning: "breakaway minus Coulomb friction",
        }],
        shapes: &[Parameter {
            name: "velocity",
            unit: "rad/s",
            bounds: [f64::MIN_POSITIVE, f64::INFINITY],
            range: [0.005, 2.0],
            scale: Scale::Logarithmic,
            meaning: "Stribeck velocity",
        }],
        signature: "odd in velocity, below about three Stribeck velocities, the same at every position and load",
        confused: &[
            Confusion {
                with: "presliding",
                exact: false,
                separated_by: "constant speeds from 0.005 to 1 rad/s, both ways",
            },
            Confusion {
                with: "drive_deadzone",
                exact: false,
                separated_by: "a measured current: with the voltage alone, friction at rest and a dead zone look the same",
            },
        ],
        needs: &[Need::SlowMotion(0.05), Need::Reversals(4)],
        compensable: true,
        leaves_out: "rising breakaway with dwell time, frictional lag",
    };

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        let share = (-(at.velocity / shapes[0]).squared()).exp();
        [share * at.direction, T::ZERO, T::ZERO, T::ZERO]
    }
}
