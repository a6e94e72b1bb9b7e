//! Row weights near gear contacts.
//!
//! At tooth contact every law has a timing error, whatever its shapes. Within 50 ms of a contact, the torque residual
//! is ten times the noise of other rows. Two recordings of one motion differ by as much. In plain least squares such
//! rows dominate, and an effect at noise level is invisible. So with a gear in the model, rows count less where the
//! residual around them is above the median. The method is that of Carroll (1982, Annals of Statistics 10): weights
//! from smoothed squares of residuals.

use crate::columns::transmission::observer::STRETCH;
use rig_numerics::statistics;

/// Returns the weight of each row of a joint, up to 1, from its residual. Rows are `period` s apart, `keep` marks used
/// ones, and runs begin at `starts`.
pub(crate) fn counts(residual: &[f64], keep: &[bool], starts: &[usize], period: f64) -> Vec<f64> {
    let reach = (STRETCH / period).ceil() as usize;
    let mut loud = vec![0.0; residual.len()];
    for pair in starts.windows(2) {
        let (start, end) = (pair[0], pair[1]);
        // Cumulated squares and counts of used rows.
        let mut sums = vec![(0.0, 0.0)];
        let (mut squares, mut used) = (0.0, 0.0);
        for k in start..end {
            if keep[k] {
                squares += residual[k] * residual[k];
                used += 1.0;
            }
            sums.push((squares, used));
        }
        for k in start..end {
            let (from, to) = ((k - start).saturating_sub(reach), k - start + reach + 1);
            let (from, to) = (sums[from], sums[to.min(end - start)]);
            loud[k] = ((to.0 - from.0).max(0.0) / f64::max(to.1 - from.1, 1.0)).sqrt();
        }
    }
    let all: Vec<f64> = (loud.iter().zip(keep))
        .filter_map(|(loud, keep)| keep.then_some(*loud))
        .collect();
    let usual = statistics::median(all).unwrap_or(0.0);
    loud.into_iter()
        .map(|loud| if loud > usual { usual / loud } else { 1.0 })
        .map(|count| count.max(f64::EPSILON))
        .collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn a_row_counts_by_what_is_left_about_it_in_its_own_run() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(4);
        // Two runs of 1000 rows, 10 ms apart. The second begins with a contact. One unused row is completely wrong.
        let touch = 1000..1020;
        let mut residual: Vec<f64> = (0..2000)
            .map(|k| (rng.random::<f64>() - 0.5) * if touch.contains(&k) { 20.0 } else { 1.0 })
            .collect();
        residual[500] = 1e6;
        let keep: Vec<bool> = (0..2000).map(|k| k != 500).collect();
        let counts = counts(&residual, &keep, &[0, 1000, 2000], 0.01);
        for k in touch.start + 6..touch.end - 6 {
            assert!((0.02..0.1).contains(&counts[k]), "{k}: {}", counts[k]);
        }
        // The contact does not affect the run before.
        let elsewhere = (0..1000).chain(1030..2000);
        for count in elsewhere.map(|k| counts[k]) {
            assert!((0.6..=1.0).contains(&count), "{count}");
        }
        let whole = counts.iter().filter(|count| **count == 1.0).count();
        assert!((900..1100).contains(&whole), "{whole}");
    }

    #[test]
    fn rows_count_whatever_is_left() {
        let all = [true; 40];
        let loudest = [vec![0.0; 39], vec![f64::MAX.sqrt()]].concat();
        for residual in [vec![0.0; 40], loudest] {
            let counts = counts(&residual, &all, &[0, 40], 0.01);
            assert!(counts.iter().all(|count| *count > 0.0 && *count <= 1.0));
        }
    }
}
