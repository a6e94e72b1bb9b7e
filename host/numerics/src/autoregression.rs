//! Autoregressive models of a series with gaps.

/// Predictors of every order up to the chosen one.
///
/// After a gap the predictors of lower order are used, so that no row is lost.
#[derive(Clone, Debug)]
pub struct Predictors {
    /// `coefficients[o][l]`: weight of the value l + 1 rows back in the prediction of order o.
    coefficients: Vec<Vec<f64>>,
    /// Standard deviation of the innovation, by order.
    sigma: Vec<f64>,
}

impl Predictors {
    /// Runs Levinson's recursion on autocovariances (lag 0 first); order by Bayes' information criterion over `rows`
    /// rows.
    pub fn of(covariance: &[f64], rows: u64) -> Self {
        let mut coefficients = vec![Vec::new()];
        let mut variance = vec![
            covariance
                .first()
                .copied()
                .unwrap_or(0.0)
                .max(f64::MIN_POSITIVE),
        ];
        for order in 1..covariance.len() {
            let last: &Vec<f64> = &coefficients[order - 1];
            let predicted: f64 = last
                .iter()
                .enumerate()
                .map(|(l, a)| a * covariance[order - 1 - l])
                .sum();
            let reflection = (covariance[order] - predicted) / variance[order - 1];
            if !(reflection.abs() < 1.0) {
                break;
            }
            let mut next: Vec<f64> = (0..order - 1)
                .map(|l| last[l] - reflection * last[order - 2 - l])
                .collect();
            next.push(reflection);
            coefficients.push(next);
            variance.push(variance[order - 1] * (1.0 - reflection * reflection));
        }
        let n = rows.max(2) as f64;
        let criterion = |o: usize| n * variance[o].ln() + o as f64 * n.ln();
        let best = (0..variance.len())
            .min_by(|&a, &b| criterion(a).total_cmp(&criterion(b)))
            .unwrap_or(0);
        coefficients.truncate(best + 1);
        Self {
            coefficients,
            sigma: variance.iter().take(best + 1).map(|v| v.sqrt()).collect(),
        }
    }

    /// Returns the highest order.
    pub fn order(&self) -> usize {
        self.sigma.len() - 1
    }

    /// Returns the weights of the preceding values, the latest first, in the prediction of an order.
    ///
    /// # Panics
    /// If `order` is above [`Predictors::order`].
    pub fn coefficients(&self, order: usize) -> &[f64] {
        &self.coefficients[order]
    }

    /// Returns the standard deviation of the innovation of an order.
    ///
    /// # Panics
    /// If `order` is above [`Predictors::order`].
    pub fn sigma(&self, order: usize) -> f64 {
        self.sigma[order]
    }
}
