//! Friction that falls at once as the joint starts to slide, with a long tail.

use super::about::About;
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use super::stribeck::Stribeck;
use crate::scalar::Real;

pub(super) struct StribeckExponential;

impl Law for StribeckExponential {
    const ABOUT: About = About {
        law: Some("exponential"),
        equation: "breakaway · exp(−|q̇|/velocity) · sgn q̇",
        source: "Tustin 1947; Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, sec. 2.1, exponent 1",
        signature: "odd in velocity, below about five Stribeck velocities, the same at every position and load",
        ..Stribeck::ABOUT
    };

    #[inline(always)]
    fn terms<T: Real>(shapes: &[T; SHAPES], _: &mut [T; MEMORY], at: &Instant<T>) -> [T; GAINS] {
        let share = (-(at.velocity / shapes[0]).abs()).exp();
        [share * at.direction, T::ZERO, T::ZERO, T::ZERO]
    }
}
