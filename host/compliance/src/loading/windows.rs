//! Means over windows of rows, and the direction of loading.
//!
//! What is decided about a window by its load (turning point, distance from it, side of a gap) must not depend on the noise
//! of that window: windows chosen by their own noisy load have noise whose mean is not zero, and the line through them is
//! biased. So even windows are judged by the odd ones and odd windows by the even ones (sample splitting). The slow course
//! of the load is the mean over such neighbours; it is the instrument of the regression as well.

use rig_numerics::statistics::mean;

/// Number of windows over all recordings, about. Fewer windows average more noise; more resolve the turning points.
const WINDOWS: usize = 800;
/// Share of the whole range beyond an extreme from which on the direction has changed.
pub(crate) const TURN: f64 = 0.04;

/// Standard deviations of the slow course within which noise alone changes no direction: the extremes of 800 windows of
/// white noise are 6.4 standard deviations apart.
const NOISE_RANGE: f64 = 6.4;
/// Standard deviations of a window's noise beyond which it has another load than its neighbours. Noise alone exceeds them once in
/// 16000 windows, so the choice does not depend on it.
const STEP_NOISE: f64 = 4.0;
/// Share of the range of the load that noise may take of its slow course: below the share that friction takes to turn. With 0.125
/// a force of 8 to 20 N with noise of 1 N was let through, and 77 of 89 of the 95 % intervals contained the truth.
const MOST_NOISE: f64 = 0.1;
/// Stretch over the largest width of the slow course: two periods then keep nine tenths of their range.
const WIDEST: usize = 8;
/// Standard deviation of white noise over the median of its absolute value.
const OF_MEDIAN: f64 = 1.4826;

/// Returns the number of rows of a window for this number of rows.
pub(crate) fn window_rows(rows: usize) -> usize {
    (rows / WINDOWS).max(1)
}

/// Returns the means over windows; the last, shorter one is left out.
pub(crate) fn means(values: &[f64], window: usize) -> Vec<f64> {
    values.chunks_exact(window).map(mean).collect()
}

/// Returns the standard deviation of the noise of a window by second differences. Their median is free of steps.
pub(crate) fn noise(values: &[f64]) -> f64 {
    let mut second: Vec<f64> = (values.windows(3))
        .map(|w| (w[0] - 2.0 * w[1] + w[2]).abs())
        .collect();
    if second.is_empty() {
        return 0.0;
    }
    second.sort_by(f64::total_cmp);
    // A second difference has six times the variance of the noise.
    OF_MEDIAN * rig_numerics::statistics::percentile(&second, 0.5) / 6f64.sqrt()
}

/// Slow course of a load.
#[derive(Clone, Debug, Default)]
pub(crate) struct Slow {
    /// Mean over neighbours of each window: one, three, … windows away.
    pub values: Vec<f64>,
    /// Number of neighbours on either side.
    pub reach: usize,
    /// Standard deviation of the noise of `values`.
    pub noise: f64,
}

impl Slow {
    /// Returns the means over `reach` neighbours on either side, fewer at the ends.
    pub(crate) fn of(values: &[f64], reach: usize) -> Self {
        let count = values.len();
        let around = |i: usize| {
            let (mut sum, mut terms) = (0.0, 0usize);
            for away in (1..2 * reach).step_by(2) {
                let before = i.checked_sub(away).map(|k| values[k]);
                for value in [before, values.get(i + away).copied()]
                    .into_iter()
                    .flatten()
                {
                    (sum, terms) = (sum + value, terms + 1);
                }
            }
            match terms {
                0 => values[i],
                _ => sum / terms as f64,
            }
        };
        Self {
            values: (0..count).map(around).collect(),
            reach,
            noise: noise(values) / ((2 * reach) as f64).sqrt(),
        }
    }

    /// Returns the least smoothed course whose noise is small beside its range; the most smoothed one if there is none.
    pub(crate) fn clear(values: &[f64]) -> Self {
        let mut reach = 1;
        loop {
            let own = Self::of(values, reach);
            if own.is_clear() || 4 * WIDEST * (reach + 1) > values.len() {
                return own;
            }
            reach += 1;
        }
    }

    /// Returns true if the noise is small beside the range.
    pub(crate) fn is_clear(&self) -> bool {
        NOISE_RANGE * self.noise <= MOST_NOISE * range(self.values.iter())
    }

    /// Returns how many times as many windows must be averaged for the noise to be small beside the range.
    pub(crate) fn shortage(&self) -> f64 {
        (NOISE_RANGE * self.noise / (MOST_NOISE * range(self.values.iter()))).powi(2)
    }

    /// Returns the course of each window of `values`, even and odd ones apart. `range` is that of the load over all stretches.
    /// Windows so near to a turning point that their neighbours lie on both sides of it have no direction; nor have windows beside
    /// a step, whose neighbours have another load by more than noise.
    pub(crate) fn courses(&self, values: &[f64], range: f64) -> Vec<Course> {
        let least = (TURN * range).max(NOISE_RANGE * self.noise);
        let step = (TURN * range).max(STEP_NOISE * self.noise * ((2 * self.reach) as f64).sqrt());
        let mut all = vec![Course::default(); self.values.len()];
        for first in 0..2 {
            let own: Vec<f64> = self.values.iter().skip(first).step_by(2).copied().collect();
            let courses = courses(&own, least);
            for (k, course) in courses.iter().enumerate() {
                let i = 2 * k + first;
                let is_steady = (values[i] - self.values[i]).abs() <= step;
                if is_steady && is_within_run(&courses, k, self.reach - 1) {
                    all[i] = *course;
                }
            }
        }
        all
    }

    /// Returns true if the range is more than that of noise.
    pub(crate) fn is_loaded(&self) -> bool {
        range(self.values.iter()) > 2.0 * NOISE_RANGE * self.noise
    }
}

/// Returns largest minus smallest value; 0 without values.
pub(crate) fn range<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(*v), h.max(*v))
    });
    (high - low).max(0.0)
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

/// Returns the course of each window of one stretch. Changes below `least` change no direction.
pub(crate) fn courses(values: &[f64], least: f64) -> Vec<Course> {
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

/// Returns true if no turning point lies within `half` windows of a window: its neighbours are on the same side.
pub(crate) fn is_within_run(courses: &[Course], i: usize, half: usize) -> bool {
    let last = courses.len().saturating_sub(1);
    courses[i.saturating_sub(half)].run == courses[(i + half).min(last)].run
}
