//! Draws of noise.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Draws noise of a deviation, also for 0, so that one noise does not change the numbers of another.
pub fn drawn(random: &mut Pcg64, deviation: f64) -> f64 {
    let unit: f64 = StandardNormal.sample(random);
    deviation * unit
}
