//! Statistics of lists of values. Sums are formed element by element, so that a result does not depend on the machine.

/// Returns the sum of the squares, in the unit squared.
pub fn sum_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum()
}

/// Returns the mean of the squares, in the unit squared; 0 without values.
pub fn mean_square(values: &[f64]) -> f64 {
    sum_of_squares(values) / values.len().max(1) as f64
}

/// Returns the root of the mean square; 0 without values.
pub fn rms(values: &[f64]) -> f64 {
    mean_square(values).sqrt()
}

/// Returns the RMS of a signal over the rows that `keep` marks; 0 without rows.
pub fn rms_of_kept(signal: &[f64], keep: &[bool]) -> f64 {
    let used = || signal.iter().zip(keep).filter(|(_, keep)| **keep);
    let squares: f64 = used().map(|(x, _)| x * x).sum();
    (squares / used().count().max(1) as f64).sqrt()
}

/// Returns the mean; not a number without values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the mean; 0 without values.
pub fn mean_or_zero(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Returns the sum of the squares of the differences from `middle`, in the unit squared.
pub fn squares_about(values: &[f64], middle: f64) -> f64 {
    values.iter().map(|v| (v - middle).powi(2)).sum()
}

/// Returns the sum of the squares about the mean, in the unit squared.
pub fn squares_about_mean(values: &[f64]) -> f64 {
    squares_about(values, mean_or_zero(values))
}

/// Returns the mean of independent values and its variance; None for fewer than three.
pub fn mean_and_variance(values: &[f64]) -> Option<[f64; 2]> {
    let n = values.len() as f64;
    let mean = mean(values);
    let squares = squares_about(values, mean);
    (n > 2.0).then(|| [mean, squares / (n * (n - 1.0))])
}

/// Returns the mean of rows in independent groups and its standard deviation. `groups` has each group's sum and number
/// of rows; rows within a group may be correlated. Groups without rows do not count.
pub fn grouped_mean(groups: &[[f64; 2]]) -> [f64; 2] {
    let count = groups.iter().filter(|[_, rows]| *rows > 0.0).count() as f64;
    let [sum, rows] = (groups.iter()).fold([0.0; 2], |all, own| [all[0] + own[0], all[1] + own[1]]);
    let mean = sum / rows;
    let squares: f64 = groups
        .iter()
        .map(|own| (own[0] - own[1] * mean).powi(2))
        .sum();
    [mean, (squares * count / (count - 1.0)).sqrt() / rows]
}

/// Returns the median; of an even number of values the upper of the two in the middle. None without values.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Returns the median of the finite values; of an even number the mean of the two in the middle. None without any.
pub fn median_of_finite(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let (low, high) = (values.get(n.saturating_sub(1) / 2)?, values.get(n / 2)?);
    Some(0.5 * (low + high))
}

/// Returns the value that the `share` (0 to 1) of the sorted values does not exceed; 0 without values.
pub fn percentile(sorted: &[f64], share: f64) -> f64 {
    let at = (share * sorted.len() as f64) as usize;
    sorted
        .get(at.min(sorted.len().saturating_sub(1)))
        .copied()
        .unwrap_or(0.0)
}

/// Sorts used rows into bins with equal counts. Returns the bin of each row (None if unused) and the edges.
pub fn bins(values: &[f64], keep: &[bool], bins: usize) -> (Vec<Option<usize>>, Vec<f64>) {
    let mut sorted: Vec<f64> = (values.iter().zip(keep))
        .filter(|(_, k)| **k)
        .map(|(v, _)| *v)
        .collect();
    sorted.sort_by(f64::total_cmp);
    if sorted.is_empty() {
        return (vec![None; values.len()], vec![0.0, 0.0]);
    }
    let edges: Vec<f64> = (0..=bins)
        .map(|b| sorted[(b * (sorted.len() - 1)) / bins])
        .collect();
    let inner = &edges[1..bins];
    let place = values
        .iter()
        .zip(keep)
        .map(|(v, k)| k.then(|| inner.partition_point(|e| e < v)))
        .collect();
    (place, edges)
}

/// Returns the correlation of two columns, -1 to 1; not a number if one of them is constant.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let [xx, xy, yy] = moments_about_means(a, b);
    xy / (xx * yy).sqrt()
}

/// Returns the sums xx, xy and yy of two columns about their means.
pub fn moments_about_means(a: &[f64], b: &[f64]) -> [f64; 3] {
    let count = a.len().min(b.len()).max(1) as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / count, b.iter().sum::<f64>() / count);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        let (x, y) = (x - ma, y - mb);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    [xx, xy, yy]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_medians_differ_for_an_even_count() {
        let values = vec![4.0, 1.0, 3.0, 2.0];
        assert_eq!(median(values.clone()), Some(3.0));
        assert_eq!(median_of_finite(values), Some(2.5));
        assert_eq!(median(Vec::new()), None);
        assert_eq!(median_of_finite(vec![f64::NAN]), None);
    }

    #[test]
    fn a_group_without_rows_changes_no_mean() {
        let groups = [[2.0, 2.0], [6.0, 2.0]];
        assert_eq!(grouped_mean(&groups), [2.0, 1.0]);
        assert_eq!(grouped_mean(&[groups[0], [0.0; 2], groups[1]]), [2.0, 1.0]);
    }
}
