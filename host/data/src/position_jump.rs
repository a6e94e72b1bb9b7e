//! Position jumps from one row to the next: a lost count, an angle that wraps after a turn, two joined recordings; and
//! outliers, single rows that are far away from both rows beside them.

/// Number of row intervals whose median speed is the local speed of the joint.
const SPAN_ROWS: usize = 8;
/// Minimum ratio of a jump to the largest other motion from row to row …
const MIN_MOTION_RATIO: f64 = 3.0;
/// … and to the changes by noise and acceleration (99th percentile), and to the smallest change.
const MIN_NOISE_RATIO: f64 = 20.0;

/// Largest sum of two changes that follow each other, as a share of the larger one, if the position jumps there and back.
const BACK: f64 = 0.25;

/// The largest jump of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PositionJump {
    /// Row before the jump.
    pub row: usize,
    /// Change of position minus that of the motion around it.
    pub change: f64,
    /// Number of jumps.
    pub count: usize,
    /// Largest change from row to row without the jumps.
    pub largest_motion_step: f64,
    /// The row that is far away from both rows beside it, and the number of such rows, if all jumps are there and back.
    pub outlier: Option<(usize, usize)>,
}

/// Returns true if a column has a jump.
pub fn has_position_jump(t: &[f64], q: &[f64]) -> bool {
    largest_position_jump(t, q).is_some()
}

/// Returns the largest jump of `q` over `t`, if any. Returns `None` if there are too few rows to know the motion.
pub(super) fn largest_position_jump(t: &[f64], q: &[f64]) -> Option<PositionJump> {
    let steps: Vec<[f64; 2]> = (t.windows(2).zip(q.windows(2)))
        .map(|(t, q)| [t[1] - t[0], q[1] - q[0]])
        .collect();
    let spans = steps.chunks_exact(SPAN_ROWS);
    if spans.len() < MIN_NOISE_RATIO as usize {
        return None;
    }
    let (mut deviations, mut largest_motion_step) = (Vec::with_capacity(steps.len()), 0.0f64);
    for span in spans {
        let mut speeds: Vec<f64> = span.iter().map(|[dt, dq]| dq / dt).collect();
        speeds.sort_by(f64::total_cmp);
        let speed = 0.5 * (speeds[SPAN_ROWS / 2 - 1] + speeds[SPAN_ROWS / 2]);
        for [dt, dq] in span {
            largest_motion_step = largest_motion_step.max((speed * dt).abs());
            deviations.push(dq - speed * dt);
        }
    }
    let mut sizes: Vec<f64> = deviations.iter().map(|x| x.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let usual_change = sizes[sizes.len() - 1 - sizes.len() / 100];
    let smallest_change = steps
        .iter()
        .map(|[_, dq]| dq.abs())
        .filter(|dq| *dq > 0.0)
        .fold(f64::INFINITY, f64::min);
    let threshold = (MIN_MOTION_RATIO * largest_motion_step)
        .max(MIN_NOISE_RATIO * usual_change.max(smallest_change));
    let count = deviations.iter().filter(|x| x.abs() > threshold).count();
    let outlier = outlier(&deviations, threshold);
    let (row, change) = (0..)
        .zip(deviations)
        .max_by(|a: &(usize, f64), b| a.1.abs().total_cmp(&b.1.abs()))?;
    (count > 0).then_some(PositionJump {
        row,
        change,
        count,
        largest_motion_step,
        outlier,
    })
}

/// Returns the row that is farthest away from both rows beside it, and the number of such rows; `None` if a change beyond
/// the threshold is not followed by its opposite.
fn outlier(deviations: &[f64], threshold: f64) -> Option<(usize, usize)> {
    let (mut rows, mut k) = (Vec::new(), 0);
    while k < deviations.len() {
        let own = deviations[k];
        if own.abs() <= threshold {
            k += 1;
            continue;
        }
        let next = deviations.get(k + 1).copied()?;
        if (own + next).abs() > BACK * own.abs().max(next.abs()) {
            return None;
        }
        rows.push((k + 1, own.abs()));
        k += 2;
    }
    let (row, _) = rows.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((*row, rows.len()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn motion(step: f64, count: f64) -> (Vec<f64>, Vec<f64>) {
        let t: Vec<f64> = (0..4000).map(|k| f64::from(k) * step).collect();
        let q =
            |t: &f64| ((0.8 * (2.3 * t).sin() + 0.1 * (31.0 * t).sin()) / count).round() * count;
        let q = t.iter().map(q).collect();
        (t, q)
    }

    #[test]
    fn a_jump_is_told_from_motion_and_from_a_coarse_encoder() {
        for step in [1e-3, 5e-3] {
            for count in [1e-12, 1e-4, 5e-3] {
                let (t, mut q) = motion(step, count);
                assert_eq!(largest_position_jump(&t, &q), None, "{step} {count}");
                q[2345..].iter_mut().for_each(|q| *q -= 0.3);
                let found = largest_position_jump(&t, &q).unwrap();
                assert_eq!((found.row, found.count, found.outlier), (2344, 1, None));
                assert!((found.change + 0.3).abs() < 0.02, "{found:?}");
            }
        }
        // Single rows that are far away from those beside them.
        for (step, count) in [(1e-3, 1e-12), (5e-3, 1e-4), (1e-3, 5e-3)] {
            for size in [0.5, -3.0, 1e4] {
                let (t, mut q) = motion(step, count);
                q[1234] += size;
                let found = largest_position_jump(&t, &q).unwrap();
                assert_eq!(found.outlier, Some((1234, 1)), "{step} {count} {size}");
                q[3210] -= 0.9 * size;
                let found = largest_position_jump(&t, &q).unwrap();
                assert_eq!(found.outlier, Some((1234, 2)), "{step} {count} {size}");
                q[2345..].iter_mut().for_each(|q| *q -= 0.7);
                let found = largest_position_jump(&t, &q).unwrap();
                assert_eq!(found.outlier, None, "{step} {count} {size}");
            }
        }
        // At rest, except for the last count of the encoder.
        let (t, mut q) = motion(1e-3, 1e-4);
        q.fill(0.7);
        for k in (0..q.len()).step_by(701) {
            q[k] += 1e-4;
        }
        assert_eq!(largest_position_jump(&t, &q), None);
        // Rest, then a sudden start.
        let q: Vec<f64> = t.iter().map(|t| (t - 3.9).max(0.0)).collect();
        assert_eq!(largest_position_jump(&t, &q), None);
    }
}
