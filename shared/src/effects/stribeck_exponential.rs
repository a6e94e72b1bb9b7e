//! Friction that falls as the joint starts to slide, at once and with a long tail.

use super::{
    About, Channel, Confusion, Direction, GAINS, Instant, Law, MEMORY, Need, Parameter, SHAPES,
    Scale,
};
use crate::scalar::Real;

pub(super) struct StribeckExponential;

impl Law for StribeckExponential {
    const ABOUT: About = About {
        name: "stribeck",
        law: Some("exponential"),
        title: "Stribeck friction",
        equation: "breakaway · exp(−|q̇|/velocity) · sgn q̇",
        source: "Tustin 1947; Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, sec. 2.1, exponent 1",
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
        signature: "odd in velocity, below about five Stribeck velocities, the same at every position and load",
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
        let share = (-(at.velocity / shapes[0]).abs()).exp();
        [share * at.direction, T::ZERO, T::ZERO, T::ZERO]
    }
}
