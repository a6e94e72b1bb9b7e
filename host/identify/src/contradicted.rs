//! Which values that are believed before the data these contradict.
//!
//! Believed values are normal with independent deviations. The data then move the mean of value k by a shift whose variance, if the
//! belief is right, is what its variance falls by (Box 1980, prior predictive check). A shift of too many of those standard
//! deviations refutes the belief. The worst one is set free and the others are judged anew: one wrong value moves the rest as well.
//!
//! Leaves out: beliefs that are correlated; errors of the model, which move values too.

use nalgebra::{DMatrix, DVector};

use rig_model::robot::CONTRADICTED;

/// How many times wider a value is believed once it is set free.
const FREE: f64 = 1e3;
/// Share of a value's variance that data have to take away to judge it: less is rounding.
const SEEN: f64 = 1e-9;

/// Those among `judged` columns that are contradicted, with by how many standard deviations, in the order in which they were set free.
///
/// `data` has the noise as unit and one column a value, `surprise` is what the believed values leave of the right side, `spread` their
/// standard deviations.
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

/// Shift of each value over its standard deviation under the belief; 0 where the data say nothing. None where rounding hides it.
fn shifts(scaled: &DMatrix<f64>, surprise: &DVector<f64>) -> Option<Vec<f64>> {
    let svd = scaled.clone().svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let along = u.tr_mul(surprise);
    let gains = &svd.singular_values;
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

    /// Rows that see three values, the last two hardly apart; what the believed values leave where the truth is `truth` away.
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
        // Not asked about: nothing to say of it.
        assert!(contradicted(&data, &right, &spread, &[]).is_empty());
        // Known too vaguely to be refuted.
        assert!(contradicted(&data, &right, &[1.0, 0.01, 0.01], &[0, 1, 2]).is_empty());
    }
}
