//! The course of a channel in constant memory.

/// Number of stretches; two are joined into one when there are more.
const MOST: usize = 600;

/// Smallest and largest value in stretches of equally many rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Time of the first row of each stretch, s.
    pub t: Vec<f64>,
    /// Smallest value in each stretch; NaN if it has none.
    pub low: Vec<f64>,
    /// Largest value in each stretch; NaN if it has none.
    pub high: Vec<f64>,
    /// Rows in a full stretch.
    rows: u64,
    /// Rows in the last stretch.
    filled: u64,
}

impl Picture {
    /// Adds a row.
    pub(super) fn add(&mut self, t: f64, value: f64) {
        if self.rows == 0 {
            self.rows = 1;
        }
        if self.t.is_empty() || self.filled == self.rows {
            if self.t.len() == MOST {
                self.halve();
            }
            // An odd number of stretches cannot be there: `MOST` is even, and all of them are full.
            self.t.push(t);
            self.low.push(f64::NAN);
            self.high.push(f64::NAN);
            self.filled = 0;
        }
        self.filled += 1;
        // `min` and `max` take the number beside a NaN.
        if let (Some(low), Some(high)) = (self.low.last_mut(), self.high.last_mut()) {
            *low = low.min(value);
            *high = high.max(value);
        }
    }

    fn halve(&mut self) {
        let joined = |list: &[f64], join: fn(f64, f64) -> f64| -> Vec<f64> {
            list.chunks(2)
                .map(|pair| pair.iter().copied().fold(f64::NAN, join))
                .collect()
        };
        self.t = self.t.iter().copied().step_by(2).collect();
        self.low = joined(&self.low, f64::min);
        self.high = joined(&self.high, f64::max);
        self.rows *= 2;
    }
}
