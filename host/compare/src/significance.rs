//! Probabilities and the level of all tests.

use rig_identify::t_quantile;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Probability of a false alarm over all tests together. The same level tells whether the remainder of a hypothesis is
/// consistent with chance.
pub const FAMILY_LEVEL: f64 = 0.01;
/// Level of the joint test, and of the tests of single parameters after Holm's correction: half of [`FAMILY_LEVEL`] for
/// each of the two.
pub const TEST_LEVEL: f64 = 0.5 * FAMILY_LEVEL;

/// Returns the probability that χ² with `freedom` degrees of freedom is at least `value`; 1 without any.
pub(crate) fn chi2_p(value: f64, freedom: usize) -> f64 {
    if freedom == 0 {
        return 1.0;
    }
    ChiSquared::new(freedom as f64).map_or(1.0, |d| d.sf(value.max(0.0)))
}

/// Returns the probability that F is at least `value`.
pub(crate) fn f_p(value: f64, freedom: [f64; 2]) -> f64 {
    FisherSnedecor::new(freedom[0], freedom[1]).map_or(1.0, |d| d.sf(value.max(0.0)))
}

/// Returns the degrees of freedom that have this quantile, from 1 to 10⁶; the inverse of [`t_quantile`].
pub(crate) fn freedom_of_quantile(quantile: f64) -> f64 {
    let (mut low, mut high) = (0.0f64, 1e6f64.ln());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match t_quantile(middle.exp()) > quantile {
            true => low = middle,
            false => high = middle,
        }
    }
    (0.5 * (low + high)).exp()
}

/// Corrects probabilities for their number (Holm 1979, "A simple sequentially rejective multiple test procedure").
pub(crate) fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let mut corrected = vec![1.0; p.len()];
    let mut most = 0.0f64;
    for (rank, &k) in order.iter().enumerate() {
        most = most.max(((p.len() - rank) as f64 * p[k]).min(1.0));
        corrected[k] = most;
    }
    corrected
}
