//! Significance of a gain on left-out data.

/// Least relative error reduction by an effect on left-out recordings.
pub(crate) const LEAST_GAIN: f64 = 0.03;
/// Level of the signed-rank test over the pieces.
pub(crate) const LEVEL: f64 = 0.05;

/// Returns the probability of such gains if losses are equally likely: Wilcoxon's signed-rank test (1945), one-sided,
/// exact. `gains` are logarithms of error before over after; zeros and NaN do not count.
pub(crate) fn signed_rank(gains: &[f64]) -> f64 {
    let mut gains: Vec<f64> = gains.iter().copied().filter(|g| g.abs() > 0.0).collect();
    gains.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let largest = gains.len() * (gains.len() + 1) / 2;
    // Probability of each sum of the ranks of gains.
    let mut chance = vec![0.0; largest + 1];
    chance[0] = 1.0;
    for rank in 1..=gains.len() {
        for sum in (0..=largest).rev() {
            let with = if sum >= rank { chance[sum - rank] } else { 0.0 };
            chance[sum] = 0.5 * (chance[sum] + with);
        }
    }
    let ranks = gains.iter().enumerate().filter(|(_, g)| **g > 0.0);
    let observed: usize = ranks.map(|(k, _)| k + 1).sum();
    chance[observed..].iter().sum::<f64>().min(1.0)
}
