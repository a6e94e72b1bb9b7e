//! Position jumps from one row to the next: a lost count, an angle that wraps after a turn, two joined recordings.

/// Number of row intervals whose median speed is the local speed of the joint.
const SPAN: usize = 8;
/// Minimum ratio of a jump to the largest other motion from row to row …
const FASTER: f64 = 3.0;
/// … and to the changes by noise and acceleration (99th percentile), and to the smallest change.
const LARGER: f64 = 20.0;

/// The largest jump of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    /// Row before the jump.
    pub row: usize,
    /// Change of position minus that of the motion around it.
    pub by: f64,
    /// Number of jumps.
    pub count: usize,
    /// Largest change from row to row without the jumps.
    pub fastest: f64,
}

/// Returns true if a column has a jump.
pub fn jumps(t: &[f64], q: &[f64]) -> bool {
    jump(t, q).is_some()
}

/// Returns the largest jump of `q` over `t`, if any. Returns `None` if there are too few rows to know the motion.
pub(super) fn jump(t: &[f64], q: &[f64]) -> Option<Jump> {
    let steps: Vec<[f64; 2]> = (t.windows(2).zip(q.windows(2)))
        .map(|(t, q)| [t[1] - t[0], q[1] - q[0]])
        .collect();
    let parts = steps.chunks_exact(SPAN);
    if parts.len() < LARGER as usize {
        return None;
    }
    let (mut apart, mut fastest) = (Vec::with_capacity(steps.len()), 0.0f64);
    for part in parts {
        let mut speeds: Vec<f64> = part.iter().map(|[dt, dq]| dq / dt).collect();
        speeds.sort_by(f64::total_cmp);
        let speed = 0.5 * (speeds[SPAN / 2 - 1] + speeds[SPAN / 2]);
        for [dt, dq] in part {
            fastest = fastest.max((speed * dt).abs());
            apart.push(dq - speed * dt);
        }
    }
    let mut sizes: Vec<f64> = apart.iter().map(|x| x.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes[sizes.len() - 1 - sizes.len() / 100];
    let least = steps
        .iter()
        .map(|[_, dq]| dq.abs())
        .filter(|dq| *dq > 0.0)
        .fold(f64::INFINITY, f64::min);
    let above = (FASTER * fastest).max(LARGER * usual.max(least));
    let count = apart.iter().filter(|x| x.abs() > above).count();
    let (row, by) = (0..)
        .zip(apart)
        .max_by(|a: &(usize, f64), b| a.1.abs().total_cmp(&b.1.abs()))?;
    (count > 0).then_some(Jump {
        row,
        by,
        count,
        fastest,
    })
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
                assert_eq!(jump(&t, &q), None, "{step} {count}");
                q[2345..].iter_mut().for_each(|q| *q -= 0.3);
                let found = jump(&t, &q).unwrap();
                assert_eq!((found.row, found.count), (2344, 1));
                assert!((found.by + 0.3).abs() < 0.02, "{found:?}");
            }
        }
        // At rest, except for the last count of the encoder.
        let (t, mut q) = motion(1e-3, 1e-4);
        q.fill(0.7);
        for k in (0..q.len()).step_by(701) {
            q[k] += 1e-4;
        }
        assert_eq!(jump(&t, &q), None);
        // Rest, then a sudden start.
        let q: Vec<f64> = t.iter().map(|t| (t - 3.9).max(0.0)).collect();
        assert_eq!(jump(&t, &q), None);
    }
}
