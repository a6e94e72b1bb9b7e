//! Jumps of the sensor's bias.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::system::{Fit, Jump, Sensed};

/// Probability by chance, of all channels and places together, below which the bias is said to jump.
const JUMPS: f64 = 1e-4;
/// Least number of segments on either side of a jump.
const LEAST_SIDE: usize = 3;

/// Finds the clearest jump of the bias. The means of the residuals over the segments on both sides of it differ by more
/// than they differ among themselves (t test, corrected for all places and channels).
pub(crate) fn jump(sensed: &Sensed, fit: &Fit) -> Option<Jump> {
    let mut clearest: Option<(f64, Jump)> = None;
    for (recording, means) in sensed.mean_residuals(fit).iter().enumerate() {
        let count = means.len();
        let is_known = fit
            .unknowns
            .jumps
            .iter()
            .any(|jump| jump.recording == recording);
        if count < 2 * LEAST_SIDE + 2 || is_known || sensed.recordings[recording].poses {
            continue;
        }
        let places = (count - 2 * LEAST_SIDE + 1) as f64;
        for segment in LEAST_SIDE..=count - LEAST_SIDE {
            for channel in 0..6 {
                let list: Vec<f64> = means.iter().map(|own| own[channel]).collect();
                let p = 6.0 * places * chance_of(&list[..segment], &list[segment..]);
                if p < JUMPS && clearest.as_ref().is_none_or(|(least, _)| p < *least) {
                    clearest = Some((p, Jump { recording, segment }));
                }
            }
        }
    }
    clearest.map(|(_, jump)| jump)
}

/// Returns the probability that two groups with one mean differ by chance as much (two-sided t test, pooled variance).
fn chance_of(before: &[f64], after: &[f64]) -> f64 {
    let mean = rig_numerics::statistics::mean;
    let squares = rig_numerics::statistics::squares_about_mean;
    let freedom = (before.len() + after.len() - 2) as f64;
    let variance = (squares(before) + squares(after)) / freedom;
    let spread = variance * (1.0 / before.len() as f64 + 1.0 / after.len() as f64);
    let t = (mean(before) - mean(after)).abs() / spread.sqrt().max(f64::MIN_POSITIVE);
    StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |d| 2.0 * d.sf(t))
}
