//! Whether a measured velocity is that of the position beside it: no model is needed for this.
//!
//! The changes of the position over windows of 50 ms are compared with those of the integrated velocity, at every shift of up to
//! 0.1 s. Leaves out: a velocity that is filtered so slowly that no shift makes both alike counts as late, or as another one.

/// Length of a window, s.
const WINDOW: f64 = 0.05;
/// Fewest rows of a window: its ends are single readings of the position.
const FEWEST: f64 = 20.0;
/// Fewest windows.
const WINDOWS: usize = 16;
/// Largest shift, s.
const FARTHEST: f64 = 0.1;
/// Share of the squares of the position's changes that a velocity of its own never leaves: 45 % RMS. A coarse encoder, and a noisy
/// velocity, leave less over a window.
const OTHER: f64 = 0.2;
/// The same from which on a shift matters: 5 % RMS of the velocity is wrong then.
const MATTERS: f64 = 0.0025;
/// Error of a factor that is no fault: an inertia is off by as much.
const EXACT: f64 = 0.03;

/// What is wrong with a measured velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RateMismatch {
    /// It is this multiple of the velocity.
    Factor(f64),
    /// It is late by this time, s; early if negative.
    Late(f64),
    /// It is counted in the opposite sense.
    Reversed,
    /// It leaves this share of the position's changes, whatever its factor and shift.
    Other(f64),
}

/// Returns what is wrong with a velocity, if anything.
pub(super) fn rate_mismatch(t: &[f64], q: &[f64], qd: &[f64]) -> Option<RateMismatch> {
    let rows = t.len().min(q.len()).min(qd.len());
    let last = rows.checked_sub(1).filter(|last| *last > 0)?;
    let dt = (t[last] - t[0]) / last as f64;
    let window = (WINDOW / dt).max(FEWEST) as usize;
    let most = (FARTHEST / dt) as usize;
    let needed = (most.saturating_mul(2)).saturating_add(window.saturating_mul(WINDOWS));
    if !(dt > 0.0) || rows < needed {
        return None;
    }
    let mut integral = Vec::with_capacity(rows);
    let mut sum = 0.0;
    for k in 0..rows {
        integral.push(sum);
        let next = (k + 1).min(rows - 1);
        sum += 0.5 * (qd[k] + qd[next]) * (t[next] - t[k]);
    }
    // At shift `most` the velocity is taken at the time of the position.
    let at = |shift: usize| -> (f64, f64) {
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for start in (most..rows - most - window).step_by(window) {
            let from = start + shift - most;
            let x = integral[from + window] - integral[from];
            let y = q[start + window] - q[start];
            xx += x * x;
            xy += x * y;
            yy += y * y;
        }
        let left = 1.0 - xy * xy / (xx * yy).max(f64::MIN_POSITIVE);
        (left, xx / xy)
    };
    let shifts: Vec<(f64, f64)> = (0..=2 * most).map(at).collect();
    let (left, _) = shifts[most];
    let best = (0..shifts.len()).min_by(|a, b| shifts[*a].0.total_cmp(&shifts[*b].0))?;
    let (least, factor) = shifts[best];
    if least > OTHER {
        return Some(RateMismatch::Other(least));
    }
    if factor <= 0.0 {
        return Some(RateMismatch::Reversed);
    }
    if (factor - 1.0).abs() > EXACT.max(least) {
        return Some(RateMismatch::Factor(factor));
    }
    (left > MATTERS.max(2.0 * least))
        .then_some(RateMismatch::Late((best as f64 - most as f64) * dt))
}

#[cfg(test)]
#[allow(clippy::panic)]
mod tests {
    use super::*;

    /// Two sines with an encoder of 10 µrad, and their exact velocity.
    fn motion(rate: f64) -> [Vec<f64>; 3] {
        let t: Vec<f64> = (0..(20.0 * rate) as usize)
            .map(|k| k as f64 / rate)
            .collect();
        let q = t.iter().map(|t| {
            let q = 0.8 * (2.0 * t).sin() + 0.2 * (7.0 * t).cos();
            (q / 1e-5).round() * 1e-5
        });
        let q = q.collect();
        let qd = t
            .iter()
            .map(|t| 1.6 * (2.0 * t).cos() - 1.4 * (7.0 * t).sin());
        let qd = qd.collect();
        [t, q, qd]
    }

    #[test]
    fn factors_delays_and_other_velocities_are_told() {
        for rate in [200.0, 1000.0] {
            let [t, q, qd] = motion(rate);
            assert_eq!(rate_mismatch(&t, &q, &qd), None);
            for factor in [0.5, 0.8, 1.1, 2.0] {
                let wrong: Vec<f64> = qd.iter().map(|v| factor * v).collect();
                let Some(RateMismatch::Factor(found)) = rate_mismatch(&t, &q, &wrong) else {
                    panic!("{factor}");
                };
                assert!((found / factor - 1.0).abs() < 1e-3, "{found}");
            }
            let rows = (0.04 * rate) as usize;
            let late: Vec<f64> = (0..qd.len()).map(|k| qd[k.saturating_sub(rows)]).collect();
            let Some(RateMismatch::Late(found)) = rate_mismatch(&t, &q, &late) else {
                panic!("{:?}", rate_mismatch(&t, &q, &late));
            };
            assert!((found - 0.04).abs() < 2e-3, "{found}");
            let against: Vec<f64> = qd.iter().map(|v| -v).collect();
            let found = rate_mismatch(&t, &q, &against);
            assert_eq!(found, Some(RateMismatch::Reversed));
            let size: Vec<f64> = qd.iter().map(|v| v.abs()).collect();
            assert!(matches!(
                rate_mismatch(&t, &q, &size),
                Some(RateMismatch::Other(_))
            ));
        }
    }

    /// No time between the rows, or too few of them: nothing is told.
    #[test]
    fn rows_without_time_between_them_are_no_motion() {
        let still = vec![1.0; 5000];
        for step in [0.0, 1e-300, -1.0] {
            let t: Vec<f64> = (0..5000).map(|k| f64::from(k) * step).collect();
            assert_eq!(rate_mismatch(&t, &still, &still), None);
        }
        for rows in 0..3 {
            assert_eq!(rate_mismatch(&still[..rows], &still, &still), None);
        }
    }

    /// A drive's velocity behind a low-pass of 30 Hz, from an encoder of 4096 counts a turn, is a sound one.
    #[test]
    fn a_filtered_velocity_of_a_coarse_encoder_is_sound() {
        let [t, q, _] = motion(1000.0);
        let count = std::f64::consts::TAU / 4096.0;
        let q: Vec<f64> = q.iter().map(|q| (q / count).round() * count).collect();
        let mut v = 0.0;
        let qd: Vec<f64> = (0..q.len())
            .map(|k| {
                let raw = (q[k] - q[k.saturating_sub(1)]) * 1000.0;
                v += 0.17 * (raw - v);
                v
            })
            .collect();
        assert_eq!(rate_mismatch(&t, &q, &qd), None);
    }
}
