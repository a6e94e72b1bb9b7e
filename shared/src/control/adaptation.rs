//! Bounds and rates of the adaptive law.

use crate::link::PARAMETER_COUNT;
use crate::scalar::Real;

/// Bounds and rates of the adaptation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Adaptation<T> {
    /// Diagonal of Γ, in unit of the parameter squared per joule.
    pub rate: [T; PARAMETER_COUNT],
    /// Smallest value of each parameter.
    pub lower: [T; PARAMETER_COUNT],
    /// Largest value of each parameter.
    pub upper: [T; PARAMETER_COUNT],
    /// |s| below which nothing is learnt, rad/s.
    pub dead_zone: T,
}

impl<T: Real> Adaptation<T> {
    /// Returns Γ for a band: adaptation·width²/(torque limit·velocity limit). With s at the highest speed, a parameter
    /// that makes the full torque then crosses its band in 1/adaptation seconds.
    pub fn design(
        adaptation: T,
        lower: [T; PARAMETER_COUNT],
        upper: [T; PARAMETER_COUNT],
        torque_limit: T,
        velocity_limit: T,
        dead_zone: T,
    ) -> Self {
        let mut rate = [T::ZERO; PARAMETER_COUNT];
        for ((rate, low), high) in rate.iter_mut().zip(lower).zip(upper) {
            *rate = adaptation * (high - low).squared() / (torque_limit * velocity_limit);
        }
        Self {
            rate,
            lower,
            upper,
            dead_zone,
        }
    }
}
