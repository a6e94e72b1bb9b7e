//! Least squares with non-negative coefficients, from normal equations.
//!
//! By hand: some coefficients have no bound and a start is known, which the crates for it do not take.

use nalgebra::{DMatrix, DVector};

/// Rounds after which only one coefficient at a time changes sides, which guarantees an end.
const PATIENCE: usize = 3;
/// Share of the largest slope below which it is rounding.
const FLAT: f64 = 1e-9;

/// Returns the x that minimizes ½·xᵀ·H·x − gᵀ·x with x ≥ 0 for `bounded`. Starts from the coefficients in `free`, which
/// receives those not at their bound.
///
/// Block principal pivoting (Portugal, Júdice & Vicente 1994; Kim & Park 2011): all violations change sides at once. If
/// that does not reduce them for some rounds, only the last changes. After `rounds`, negative values become zero. H is
/// positive definite by its priors; `None` if it is not.
pub fn nnls(
    h: &DMatrix<f64>,
    g: &DVector<f64>,
    bounded: &[bool],
    free: &mut [bool],
    rounds: usize,
) -> Option<DVector<f64>> {
    let size = g.len();
    let flat = FLAT * g.amax();
    for (own, bounded) in free.iter_mut().zip(bounded) {
        *own |= !bounded;
    }
    let (mut least, mut patience) = (usize::MAX, PATIENCE);
    let mut x = DVector::zeros(size);
    for _ in 0..rounds {
        let at: Vec<usize> = (0..size).filter(|k| free[*k]).collect();
        x.fill(0.0);
        if !at.is_empty() {
            let own = h.select_rows(&at).select_columns(&at);
            let solved = own.cholesky()?.solve(&g.select_rows(&at));
            for (k, value) in at.iter().zip(solved.iter()) {
                x[*k] = *value;
            }
        }
        let slope = h * &x - g;
        let wrong: Vec<usize> = (0..size)
            .filter(|k| {
                bounded[*k]
                    && if free[*k] {
                        x[*k] < 0.0
                    } else {
                        slope[*k] < -flat
                    }
            })
            .collect();
        let Some(last) = wrong.last() else {
            return Some(x);
        };
        if wrong.len() < least {
            (least, patience) = (wrong.len(), PATIENCE);
        } else {
            patience = patience.saturating_sub(1);
        }
        if patience > 0 {
            wrong.iter().for_each(|k| free[*k] = !free[*k]);
        } else {
            free[*last] = !free[*last];
        }
    }
    // A few undecided ones may remain; they matter little.
    x.iter_mut()
        .zip(bounded)
        .filter(|(_, bounded)| **bounded)
        .for_each(|(x, _)| *x = x.max(0.0));
    Some(x)
}

#[cfg(test)]
#[allow(clippy::panic)]
mod tests {
    use super::*;

    /// The Karush-Kuhn-Tucker conditions hold, also with many active bounds.
    #[test]
    fn slopes_are_zero_inside_and_point_outwards_at_the_bounds() {
        let size = 30;
        let noise = |k: usize| ((k * 7919 % 1009) as f64 / 1009.0 - 0.5) * 2.0;
        let a = DMatrix::from_fn(80, size, |r, c| noise(r * size + c + 1));
        let y = DVector::from_fn(80, |r, _| noise(31 * r + 5));
        let (h, g) = (a.transpose() * &a, a.transpose() * &y);
        let bounded: Vec<bool> = (0..size).map(|k| k % 5 != 0).collect();
        let mut free = vec![false; size];
        let Some(x) = nnls(&h, &g, &bounded, &mut free, 100) else {
            panic!("positive definite")
        };
        let slope = &h * &x - &g;
        let at_bound = (0..size).filter(|k| x[*k] == 0.0).count();
        assert!(at_bound > 5 && at_bound < size - 5, "{at_bound}");
        for k in 0..size {
            assert!(!bounded[k] || x[k] >= 0.0);
            let inside = !bounded[k] || x[k] > 0.0;
            assert!(if inside {
                slope[k].abs() < 1e-9
            } else {
                slope[k] > -1e-9
            });
        }
    }
}
