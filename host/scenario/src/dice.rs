//! Seeded draws.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64Mcg;

use rig_plant::stream;

/// A stream of draws for one purpose.
pub(super) struct Dice(Pcg64Mcg);

impl Dice {
    /// Equal seeds and purposes give equal draws; other purposes independent ones.
    pub(super) fn new(seed: u64, purpose: u64) -> Self {
        Self(stream(seed, purpose))
    }

    /// Between `low` and `high`.
    pub(super) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let share: f64 = StandardUniform.sample(&mut self.0);
        low + (high - low) * share
    }

    /// Between `low` and `high`, uniform in the logarithm.
    pub(super) fn log_uniform(&mut self, [low, high]: [f64; 2]) -> f64 {
        self.uniform(low.ln(), high.ln()).exp()
    }

    /// −1 or 1.
    pub(super) fn sign(&mut self) -> f64 {
        self.uniform(-1.0, 1.0).signum()
    }

    /// An angle on the full circle, rad.
    pub(super) fn phase(&mut self) -> f64 {
        self.uniform(0.0, TAU)
    }

    /// Standard normal.
    pub(super) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// A whole number below `count`, 0 where there is none.
    pub(super) fn index(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }
}
