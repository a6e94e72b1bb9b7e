//! Spacing of the rows in time: mean step, longest stretch, and steps unlike the others.

/// Longest step between neighbouring rows that is interpolated, as a multiple of the mean step. The reader already
/// splits recordings at five usual steps, so no recording from a file is refused for this.
pub(super) const LONGEST_STEP: f64 = 5.0;

/// Allowed deviation of the time from the even grid over [`STEPS_TOGETHER`] rows, as a share of a step. Accepts stamps
/// of single precision, a clock with jitter and single stamps off the grid. A lost or doubled row exceeds it.
const STEP_TOLERANCE: f64 = 0.4;

/// Number of rows over which the deviation from the grid is measured.
const STEPS_TOGETHER: usize = 8;

/// Relative difference below which steps count as equal: the first of them is reported.
const ROUNDING: f64 = 1e-9;

/// Steps of a recording, taken row by row.
pub(super) struct Spacing {
    /// Rows.
    pub rows: u64,
    /// Rows of the longest stretch without a gap.
    pub longest: u64,
    /// Longest step within a stretch, s.
    pub longest_step: f64,
    /// Sum of the steps, s.
    span: f64,
    steps: u64,
    /// Rows of the present stretch.
    run: u64,
    last_time: f64,
    /// Times of the last rows, s.
    recent: [f64; STEPS_TOGETHER],
    /// Shortest duration of [`STEPS_TOGETHER`] steps, s, and its line; line 0 if no stretch was long enough.
    shortest: (f64, u64),
    /// The same of the longest duration.
    widest: (f64, u64),
}

impl Spacing {
    pub(super) fn new() -> Self {
        Self {
            rows: 0,
            longest: 0,
            longest_step: 0.0,
            span: 0.0,
            steps: 0,
            run: 0,
            last_time: 0.0,
            recent: [0.0; STEPS_TOGETHER],
            shortest: (f64::INFINITY, 0),
            widest: (0.0, 0),
        }
    }

    /// Takes the time of the next row, s. Returns true if the row follows the one before without a gap.
    pub(super) fn push(&mut self, t: f64, line: u64, continues: bool) -> bool {
        let follows = self.rows > 0 && continues;
        let place = self.rows as usize % STEPS_TOGETHER;
        if follows {
            let step = t - self.last_time;
            self.span += step;
            self.longest_step = self.longest_step.max(step);
            self.steps += 1;
            if self.run >= STEPS_TOGETHER as u64 {
                let together = t - self.recent[place];
                if together < self.shortest.0 * (1.0 - ROUNDING) {
                    self.shortest = (together, line);
                }
                if together > self.widest.0 * (1.0 + ROUNDING) {
                    self.widest = (together, line);
                }
            }
            self.run += 1;
        } else {
            self.run = 1;
        }
        self.longest = self.longest.max(self.run);
        self.recent[place] = t;
        self.last_time = t;
        self.rows += 1;
        follows
    }

    /// Returns the mean rate so far, Hz; not finite before the first step.
    pub(super) fn rate(&self) -> f64 {
        self.steps as f64 / self.span
    }

    /// Returns the mean step, s.
    pub(super) fn mean(&self) -> f64 {
        self.span / self.steps.max(1) as f64
    }

    /// Returns the line near which the rows are off the even grid; `None` if they are evenly spaced.
    pub(super) fn uneven_line(&self) -> Option<u64> {
        let mean = self.mean();
        let is_off = |&(together, line): &(f64, u64)| {
            // Skipped if no stretch was long enough.
            if !together.is_finite() || line == 0 {
                return false;
            }
            // The step if a single row caused the whole deviation.
            let step = together - (STEPS_TOGETHER - 1) as f64 * mean;
            let deviation = (step / mean - 1.0).abs();
            deviation > STEP_TOLERANCE || deviation.is_nan()
        };
        let found = [self.shortest, self.widest].into_iter().find(is_off);
        found.map(|(_, line)| line)
    }
}
