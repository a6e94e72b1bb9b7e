//! Test for prior values that the data contradict.
//!
//! The prior is normal with independent deviations. The data shift the mean of value k. If the prior is right, the
//! shift's variance is the decrease of the value's variance (Box 1980, prior predictive check). A shift of too many
//! such standard deviations refutes the prior. The worst value is freed and the others are tested again, because one
//! wrong value shifts the rest.
//!
//! Limits: no correlated priors; errors of the model also shift values.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

use rig_model::robot::CONTRADICTED;

/// Factor on the prior deviation of a freed value.
const FREE: f64 = 1e3;
/// Smallest relative decrease of a value's variance for a test; smaller ones are rounding errors.
const SEEN: f64 = 1e-9;

/// Returns the contradicted columns among `judged`, each with its number of standard deviations, in the order of
/// freeing.
///
/// `data` is in units of the noise and has one column per value, `surprise` is the residual of the prior values,
/// `spread` their standard deviations.
pub fn contradicted(
    data: &DMatrix<f64>,
    surprise: &DVector<f64>,
    spread: &[f64],
    judged: &[usize],
) -> Vec<(usize, f64)> {
    let mut scaled = data.clone();
    for (mut column, spread) in scaled.column_iter_mut().zip(spread) {
        column *= *spread;
    }
    let mut found: Vec<(usize, f64)> = Vec::new();
    loop {
        let left = (judged.iter().copied()).filter(|c| found.iter().all(|(other, _)| other != c));
        let Some(shifts) = shifts(&scaled, surprise) else {
            return found;
        };
        let worst = (left.map(|c| (c, shifts[c]))).max_by(|a, b| a.1.total_cmp(&b.1));
        match worst {
            Some((c, times)) if times > CONTRADICTED => {
                found.push((c, times));
                let mut column = scaled.column_mut(c);
                column *= FREE;
            }
            _ => return found,
        }
    }
}

/// Returns each value's shift over its standard deviation under the prior; 0 without information. None if rounded away.
fn shifts(scaled: &DMatrix<f64>, surprise: &DVector<f64>) -> Option<Vec<f64>> {
    let svd = Svd::of(scaled.clone());
    let (v_t, gains) = (&svd.v_t, &svd.singular_values);
    let along = svd.u.tr_mul(surprise);
    let step = v_t.tr_mul(&DVector::from_fn(gains.len(), |k, _| {
        gains[k] / (1.0 + gains[k] * gains[k]) * along[k]
    }));
    let taken = |c: usize| -> f64 {
        let share = |k: usize| gains[k] * gains[k] / (1.0 + gains[k] * gains[k]);
        (0..gains.len())
            .map(|k| v_t[(k, c)].powi(2) * share(k))
            .sum()
    };
    let times = |c: usize| {
        let taken = taken(c);
        if taken > SEEN {
            step[c].abs() / taken.sqrt()
        } else {
            0.0
        }
    };
    Some((0..scaled.ncols()).map(times).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of three values, the last two nearly collinear, and the prior's residual if the truth is `truth` away.
    fn seen(truth: [f64; 3]) -> (DMatrix<f64>, DVector<f64>) {
        let data = DMatrix::from_fn(60, 3, |r, c| {
            let t = 0.1 * r as f64;
            [t.sin(), t.cos(), t.cos() + 1e-3 * (3.0 * t).sin()][c] * 20.0
        });
        let noise = DVector::from_fn(60, |r, _| ((r * 37 % 11) as f64 - 5.0) / 5.0);
        let right = &data * DVector::from_column_slice(&truth) + noise;
        (data, right)
    }

    #[test]
    fn only_what_the_data_tell_apart_and_refute_is_contradicted() {
        let spread = [0.01, 0.01, 0.01];
        let (data, right) = seen([0.005, -0.01, 0.01]);
        assert!(contradicted(&data, &right, &spread, &[0, 1, 2]).is_empty());
        let (data, right) = seen([1.2, 0.0, 0.0]);
        let found = contradicted(&data, &right, &spread, &[0, 1, 2]);
        assert!(
            matches!(found.as_slice(), [(0, times)] if *times > 50.0),
            "{found:?}"
        );
        // Not tested, so nothing is contradicted.
        assert!(contradicted(&data, &right, &spread, &[]).is_empty());
        // The prior is too wide to be refuted.
        assert!(contradicted(&data, &right, &[1.0, 0.01, 0.01], &[0, 1, 2]).is_empty());
    }
}
