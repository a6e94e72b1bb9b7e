//! The noise floor: what no model of the motion can explain.

use super::rows::Rows;
use super::runs::Run;

/// Two recordings repeat each other when their references (else their positions) differ by less than this share of their
/// spread.
const ALIKE: f64 = 0.02;
/// Lags looked at for the memory of a residual, s.
const LONGEST_MEMORY: f64 = 2.0;

/// Pairs of runs that repeat one motion.
pub fn repeats(runs: &[Run]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for a in 0..runs.len() {
        for b in a + 1..runs.len() {
            if runs[a].recording != runs[b].recording && alike(&runs[a], &runs[b]) {
                pairs.push((a, b));
            }
        }
    }
    pairs
}

fn alike(a: &Run, b: &Run) -> bool {
    let rows = a.len().min(b.len());
    if rows < 1000.min(a.len().max(b.len())) || a.len().abs_diff(b.len()) > rows / 10 {
        return false;
    }
    a.joints.iter().zip(&b.joints).all(|(a, b)| {
        let (x, y) = match (&a.reference, &b.reference) {
            (Some(x), Some(y)) => (x, y),
            _ => (&a.q, &b.q),
        };
        let mean = x[..rows].iter().sum::<f64>() / rows as f64;
        let spread: f64 = x[..rows].iter().map(|x| (x - mean).powi(2)).sum();
        let apart: f64 = x[..rows]
            .iter()
            .zip(&y[..rows])
            .map(|(x, y)| (x - y).powi(2))
            .sum();
        apart <= ALIKE * ALIKE * spread
    })
}

/// RMS of a joint's noise from residuals of repeated runs: what differs between them over √2. None without a repeat.
pub fn from_repeats(
    rows: &Rows,
    pairs: &[(usize, usize)],
    residual: &[f64],
    joint: usize,
) -> Option<f64> {
    let (mut squares, mut count) = (0.0, 0_u64);
    for &(a, b) in pairs {
        let (start_a, start_b) = (rows.starts[a], rows.starts[b]);
        let length = (rows.starts[a + 1] - start_a).min(rows.starts[b + 1] - start_b);
        for k in 0..length {
            let (i, j) = (start_a + k, start_b + k);
            if rows.keep[joint][i] && rows.keep[joint][j] {
                squares += 0.5 * (residual[i] - residual[j]).powi(2);
                count += 1;
            }
        }
    }
    (count > 0).then(|| (squares / count as f64).sqrt())
}

/// Time over which a joint's residual is correlated, s: the integral of its autocorrelation up to the first zero, the
/// longest over the joints.
pub fn memory(rows: &Rows, residuals: &[Vec<f64>]) -> f64 {
    let lags = ((LONGEST_MEMORY / rows.period).ceil() as usize).min(rows.count / 4);
    let of = |residual: &Vec<f64>| {
        let squares: f64 = residual.iter().map(|r| r * r).sum();
        let mut sum = 0.5;
        for lag in 1..=lags {
            let mut product = 0.0;
            for pair in rows.starts.windows(2) {
                let stretch = &residual[pair[0]..pair[1]];
                if let Some(ahead) = stretch.get(lag..) {
                    product += ahead.iter().zip(stretch).map(|(a, b)| a * b).sum::<f64>();
                }
            }
            if product <= 0.0 || squares == 0.0 {
                break;
            }
            sum += product / squares;
        }
        2.0 * sum * rows.period
    };
    residuals.iter().map(of).fold(rows.period, f64::max)
}
