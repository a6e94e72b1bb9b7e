//! Statistics of plain lists of values.

/// Sorts used rows into bins with equal counts. Returns the bin of each row (None if unused) and the edges.
pub(crate) fn bins(values: &[f64], keep: &[bool], bins: usize) -> (Vec<Option<usize>>, Vec<f64>) {
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

/// Returns the share of the gap that an RMS drop closes, at most 1; 0 without a gap, NaN if the floor is unknown.
pub(crate) fn closed([before, after]: [f64; 2], floor: f64) -> f64 {
    if floor.is_nan() {
        f64::NAN
    } else if before > floor {
        // Below the floor there is no gap.
        ((before - after) / (before - floor)).min(1.0)
    } else {
        0.0
    }
}

/// Returns the RMS of a signal over the used rows.
pub(crate) fn rms(signal: &[f64], keep: &[bool]) -> f64 {
    let used = || signal.iter().zip(keep).filter(|(_, keep)| **keep);
    let squares: f64 = used().map(|(x, _)| x * x).sum();
    (squares / used().count().max(1) as f64).sqrt()
}

/// Returns the mean of independent values and its variance; None for fewer than three.
pub(crate) fn mean(values: &[f64]) -> Option<[f64; 2]> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (n > 2.0).then(|| [mean, squares / (n * (n - 1.0))])
}
