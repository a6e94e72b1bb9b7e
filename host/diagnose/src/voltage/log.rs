//! Recordings for a voltage-driven simulation: rows as written, without filter or even grid.

use rig_model::robot::VoltageController;

/// Rows on each side for the velocity at a row: a parabola through eleven rows.
pub(crate) const SIDE: usize = 5;
/// The same for a reference without noise: a parabola through five rows.
const REFERENCE_SIDE: usize = 2;

/// A stretch of a recording without a gap.
#[derive(Clone, Debug, Default)]
pub(crate) struct Log {
    /// Name of the recording.
    pub label: String,
    /// s
    pub t: Vec<f64>,
    /// rad or m
    pub q: Vec<f64>,
    /// V
    pub u: Vec<f64>,
    /// Reference position, rad or m; empty if not recorded.
    pub reference: Vec<f64>,
    /// V; 1 if not recorded.
    pub supply: Vec<f64>,
    /// Velocity of the reference, rad/s or m/s; empty if not recorded.
    pub reference_velocity: Vec<f64>,
    /// Acceleration of the reference, rad/s² or m/s²; empty if not recorded.
    pub reference_acceleration: Vec<f64>,
    /// The controller that closes the loop; `None` if the recorded voltage drives.
    pub law: Option<VoltageController>,
    /// The controller's integral of the position error at each row, rad·s or m·s; empty if it has none.
    pub integral: Vec<f64>,
    /// True if the drive is on; an idle bridge passes no current, so nothing brakes.
    pub on: Vec<bool>,
}

impl Log {
    /// Returns the duration, s.
    pub(crate) fn duration(&self) -> f64 {
        self.t
            .last()
            .zip(self.t.first())
            .map_or(0.0, |(b, a)| b - a)
    }

    /// Returns velocity and acceleration at a row by a parabola through its neighbours.
    pub(crate) fn slope(&self, row: usize) -> [f64; 2] {
        slope(&self.t, &self.q, row, SIDE)
    }

    /// Computes the derivatives of the reference from its rows.
    pub(crate) fn read_slopes(&mut self) {
        if self.reference.len() == self.t.len() {
            let slopes =
                (0..self.t.len()).map(|k| slope(&self.t, &self.reference, k, REFERENCE_SIDE));
            (self.reference_velocity, self.reference_acceleration) =
                slopes.map(|[v, a]| (v, a)).unzip();
        }
    }

    /// Returns pieces of about `length` seconds; the whole for infinity.
    pub(crate) fn windows(&self, length: f64) -> Vec<Segment> {
        let mut list = Vec::new();
        let (mut from, last) = (0, self.t.len().saturating_sub(1));
        while from < last {
            let end = self.t[from] + length;
            let mut to = (from..=last).find(|k| self.t[*k] > end).unwrap_or(last + 1);
            // A short remainder joins the piece before it.
            if self.t[last] - self.t[to.min(last)] < 0.5 * length {
                to = last + 1;
            }
            list.push(Segment {
                from,
                to,
                velocity: self.slope(from)[0],
            });
            from = to;
        }
        list
    }
}

/// Returns first and second derivative of a column at a row by a parabola through `side` rows on each side.
fn slope(t: &[f64], column: &[f64], row: usize, side: usize) -> [f64; 2] {
    let last = t.len().saturating_sub(1);
    let (low, high) = (row.saturating_sub(side), (row + side).min(last));
    let mut s = [0.0; 5];
    let mut b = [0.0; 3];
    for k in low..=high {
        let (x, y) = (t[k] - t[row], column[k] - column[row]);
        let mut power = 1.0;
        for (n, sum) in s.iter_mut().enumerate() {
            *sum += power;
            if n < 3 {
                b[n] += power * y;
            }
            power *= x;
        }
    }
    let a = nalgebra::Matrix3::new(s[0], s[1], s[2], s[1], s[2], s[3], s[2], s[3], s[4]);
    a.lu()
        .solve(&nalgebra::Vector3::from(b))
        .map_or([0.0; 2], |c| [c[1], 2.0 * c[2]])
}

/// Rows of a log in one simulation from the recorded state of the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    /// First row.
    pub from: usize,
    /// One past the last.
    pub to: usize,
    /// Velocity at the first row, rad/s or m/s.
    pub velocity: f64,
}

/// Returns the noise floor from the encoder's steps: the smallest step over √12.
pub(crate) fn floor(logs: &[Log]) -> f64 {
    let steps = logs.iter().flat_map(|log| log.q.windows(2));
    let largest = (logs.iter().flat_map(|log| &log.q)).fold(0.0_f64, |m, q| m.max(q.abs()));
    let least = steps
        .map(|pair| (pair[1] - pair[0]).abs())
        // Smaller steps are rounding of the file.
        .filter(|step| *step > 1.0e-6 * largest)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() {
        least / 12.0_f64.sqrt()
    } else {
        0.0
    }
}
