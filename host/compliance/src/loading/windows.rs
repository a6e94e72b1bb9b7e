//! Means over windows of rows, and the direction of loading.

use rig_numerics::statistics::mean;

/// Number of windows over all recordings, about. Fewer windows average more noise; more resolve the turning points.
const WINDOWS: usize = 800;
/// Share of the whole range beyond an extreme from which on the direction has changed.
const TURN: f64 = 0.04;

/// Returns the number of rows of a window for this number of rows.
pub(crate) fn window_rows(rows: usize) -> usize {
    (rows / WINDOWS).max(1)
}

/// Returns the means over windows; the last, shorter one is left out.
pub(crate) fn means(values: &[f64], window: usize) -> Vec<f64> {
    values.chunks_exact(window).map(mean).collect()
}

/// Direction of a window, and how far it is from the last turning point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Course {
    /// 1 for growing, -1 for falling, 0 before the first change.
    pub direction: f64,
    /// Distance from the last turning point, or from the start.
    pub travel: f64,
    /// Distance to the next turning point, or to the end.
    pub ahead: f64,
    /// Number of the run between two turning points.
    pub run: usize,
}

/// Returns the course of each window of one stretch. `range` is the range of all stretches together. Noise and steps
/// below [`TURN`] of it change no direction.
pub(crate) fn courses(values: &[f64], range: f64) -> Vec<Course> {
    let least = TURN * range;
    let mut all = vec![Course::default(); values.len()];
    let Some(first) = values.first() else {
        return all;
    };
    // The last turning point, and the extreme since then that may become the next one.
    let (mut direction, mut turned, mut run) = (0.0, 0, 0);
    let (mut low, mut high) = ((0, *first), (0, *first));
    let mut extreme = (0, *first);
    let mut settle = |from: usize, to: usize, direction: f64, run: usize| {
        for k in from..to {
            all[k] = Course {
                direction,
                travel: (values[k] - values[from]).abs(),
                ahead: (values[to.min(values.len() - 1)] - values[k]).abs(),
                run,
            };
        }
    };
    for (k, value) in values.iter().enumerate() {
        if direction == 0.0 {
            if *value < low.1 {
                low = (k, *value);
            }
            if *value > high.1 {
                high = (k, *value);
            }
            if high.1 - low.1 > least {
                (direction, extreme) = if high.0 > low.0 {
                    (1.0, high)
                } else {
                    (-1.0, low)
                };
                turned = low.0.min(high.0);
            }
        } else if direction * (value - extreme.1) >= 0.0 {
            extreme = (k, *value);
        } else if direction * (extreme.1 - value) > least {
            settle(turned, extreme.0, direction, run);
            (turned, direction, run) = (extreme.0, -direction, run + 1);
            extreme = (k, *value);
        }
    }
    settle(turned, values.len(), direction, run);
    all
}
