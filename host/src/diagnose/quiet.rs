//! Rows that touches make loud count less.
//!
//! Where teeth touch, a law is off by the instant of the touch, whatever its shapes: within 50 ms of one the torque departs by
//! ten times the noise of all other rows, and two recordings of one motion depart from each other by as much. By least squares
//! over all rows alike touches are all that counts, and an effect as large as the noise shows in nothing. So once a gear is in
//! the model a row counts by what is left about it, where that is more than about half of all rows (Carroll 1982, Annals of
//! Statistics 10: weights from smoothed squares of residuals).

use super::rows::Rows;
use super::transmission::STRETCH;

/// What each row of a joint counts beside the others, up to 1, where this is left of it.
pub(super) fn counts(rows: &Rows, residual: &[f64], joint: usize) -> Vec<f64> {
    let keep = &rows.keep[joint];
    let reach = (STRETCH / rows.period).ceil() as usize;
    let mut loud = vec![0.0; residual.len()];
    for pair in rows.starts.windows(2) {
        let (start, end) = (pair[0], pair[1]);
        // Sums of squares and numbers of rows up to each row.
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
    let mut all: Vec<f64> = (loud.iter().zip(keep))
        .filter_map(|(loud, keep)| keep.then_some(*loud))
        .collect();
    all.sort_by(f64::total_cmp);
    let usual = all.get(all.len() / 2).copied().unwrap_or(0.0);
    loud.into_iter()
        .map(|loud| if loud > usual { usual / loud } else { 1.0 })
        .map(|count| count.max(f64::EPSILON))
        .collect()
}
