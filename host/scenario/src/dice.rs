//! Random draws from a seed.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64Mcg;

use rig_plant::stream;

/// A stream of draws for one purpose.
pub(super) struct Dice(Pcg64Mcg);

impl Dice {
    /// Creates the stream of a seed and purpose; other purposes give independent draws.
    pub(super) fn new(seed: u64, purpose: u64) -> Self {
        Self(stream(seed, purpose))
    }

    /// Draws uniformly between `low` and `high`.
    pub(super) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let share: f64 = StandardUniform.sample(&mut self.0);
        low + (high - low) * share
    }

    /// Draws between `low` and `high`, uniformly in the logarithm.
    pub(super) fn log_uniform(&mut self, [low, high]: [f64; 2]) -> f64 {
        self.uniform(low.ln(), high.ln()).exp()
    }

    /// Draws −1 or 1.
    pub(super) fn sign(&mut self) -> f64 {
        self.uniform(-1.0, 1.0).signum()
    }

    /// Draws an angle on the full circle, rad.
    pub(super) fn phase(&mut self) -> f64 {
        self.uniform(0.0, TAU)
    }

    /// Draws from the standard normal distribution.
    pub(super) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Draws a whole number below `count`; 0 if `count` is 0.
    pub(super) fn index(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }
}
