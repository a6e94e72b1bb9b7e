//! Confidence intervals of proportions.

use serde::Serialize;

/// Normal quantile of a two-sided 95 % interval.
const QUANTILE: f64 = 1.959_963_984_540_054;

/// A proportion with its 95 % interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Proportion {
    /// Number of hits.
    pub hits: usize,
    /// Number of trials.
    pub of: usize,
    /// Score interval without continuity correction (Wilson 1927, JASA 22:209); 0 to 1 without trials.
    pub interval: [f64; 2],
}

impl Proportion {
    /// Counts the hits (`true`) and the trials.
    pub fn of(outcomes: impl IntoIterator<Item = bool>) -> Self {
        let (mut hits, mut of) = (0, 0);
        for outcome in outcomes {
            hits += usize::from(outcome);
            of += 1;
        }
        Self {
            hits,
            of,
            interval: wilson(hits, of),
        }
    }
}

impl std::fmt::Display for Proportion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.of == 0 {
            return write!(f, "–");
        }
        let percent = 100.0 * self.hits as f64 / self.of as f64;
        let [low, high] = self.interval.map(|x| 100.0 * x);
        write!(
            f,
            "{}/{} = {percent:.1} % [{low:.1}, {high:.1}]",
            self.hits, self.of
        )
    }
}

fn wilson(hits: usize, of: usize) -> [f64; 2] {
    if of == 0 {
        return [0.0, 1.0];
    }
    let n = of as f64;
    let p = hits as f64 / n;
    let z = QUANTILE * QUANTILE / n;
    let middle = (p + 0.5 * z) / (1.0 + z);
    let half = (z * p * (1.0 - p) + 0.25 * z * z).sqrt() / (1.0 + z);
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_solve_the_score_equation() {
        // Both ends satisfy |p − x| = z·√(x(1 − x)/n). Without trials the interval is 0 to 1.
        for (hits, of) in [(0, 20), (1, 20), (13, 20), (20, 20), (484, 500)] {
            let p = hits as f64 / of as f64;
            for x in wilson(hits, of) {
                let limit = QUANTILE * (x * (1.0 - x) / of as f64).sqrt();
                assert!(((p - x).abs() - limit).abs() < 1e-12, "{hits}/{of}: {x}");
            }
        }
        let [low, high] = wilson(0, 20);
        assert!(low == 0.0 && (high - 0.161_125).abs() < 1e-6);
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
    }
}
