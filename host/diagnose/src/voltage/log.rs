//! Recordings as a voltage-driven simulation takes them: rows as they were written, no filter, no even grid.

use super::law::Law;
use crate::DiagnoseError;
use rig_data::prepare::Recording;
use rig_model::robot::VoltageController;

/// Rows on each side that the velocity at a row is taken from: a parabola through eleven rows.
const SIDE: usize = 5;
/// The same for a reference, which has no noise: a parabola through five rows.
const REFERENCE_SIDE: usize = 2;
/// A voltage is known well enough between rows this many periods apart; farther apart there is a gap.
const GAP: f64 = 5.0;
/// Column that says whether the drive is on.
const ENABLE: &str = "torque_enable";
/// Column of the supply's voltage.
const SUPPLY: &str = "supply";

/// A stretch of a recording without a gap.
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    /// Of which recording.
    pub label: String,
    /// s
    pub t: Vec<f64>,
    /// rad or m
    pub q: Vec<f64>,
    /// V
    pub u: Vec<f64>,
    /// Reference position, rad or m; empty where none was recorded.
    pub reference: Vec<f64>,
    /// V; 1 where it was not recorded.
    pub supply: Vec<f64>,
    /// Velocity of the reference, rad/s or m/s; empty where none was recorded.
    pub reference_velocity: Vec<f64>,
    /// Acceleration of the reference, rad/s² or m/s²; empty where none was recorded.
    pub reference_acceleration: Vec<f64>,
    /// The controller that closes the loop; none where the recorded voltage drives.
    pub law: Option<VoltageController>,
    /// Integral of the position error as its controller had it at each row, rad·s or m·s; empty where that has none.
    pub integral: Vec<f64>,
    /// Whether the drive is on; an idle bridge lets no current flow, so that nothing brakes.
    pub on: Vec<bool>,
}

impl Log {
    /// s
    pub(super) fn duration(&self) -> f64 {
        self.t
            .last()
            .zip(self.t.first())
            .map_or(0.0, |(b, a)| b - a)
    }

    /// Velocity and acceleration at a row by a parabola through its neighbours.
    pub(super) fn slope(&self, row: usize) -> [f64; 2] {
        slope(&self.t, &self.q, row, SIDE)
    }

    /// Takes the slopes of the reference from its rows.
    pub(super) fn read_slopes(&mut self) {
        if self.reference.len() == self.t.len() {
            let slopes =
                (0..self.t.len()).map(|k| slope(&self.t, &self.reference, k, REFERENCE_SIDE));
            (self.reference_velocity, self.reference_acceleration) =
                slopes.map(|[v, a]| (v, a)).unzip();
        }
    }

    /// Takes the controller from the rows.
    pub(super) fn read_controller(&mut self) {
        self.read_slopes();
        if let Some(law) = Law::of(self) {
            (self.law, self.integral) = (Some(law.controller), law.integral);
        }
    }

    /// Pieces of about `length` seconds; the whole where it is infinite.
    pub(super) fn windows(&self, length: f64) -> Vec<Segment> {
        let mut list = Vec::new();
        let (mut from, last) = (0, self.t.len().saturating_sub(1));
        while from < last {
            let end = self.t[from] + length;
            let mut to = (from..=last).find(|k| self.t[*k] > end).unwrap_or(last + 1);
            // A short rest joins the piece before it.
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

/// First and second derivative of a column at a row by a parabola through `side` rows on each side.
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

/// Rows of a log that are simulated from the recorded state of the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// First row.
    pub from: usize,
    /// One past the last.
    pub to: usize,
    /// At the first row, rad/s or m/s.
    pub velocity: f64,
}

/// Reads the first joint of `recordings`.
///
/// # Errors
/// What reading gives; a recording without a voltage.
pub(super) fn logs(recordings: &[&dyn Recording]) -> Result<Vec<Log>, DiagnoseError> {
    let mut list: Vec<Log> = Vec::new();
    for source in recordings {
        let first = list.len();
        source.each_block(65_536, &mut |block| {
            let follows = |log: &Log| {
                let rows = log.t.len();
                rows > 1
                    && block.t.first().is_some_and(|t| {
                        let period = (log.t[rows - 1] - log.t[0]) / (rows - 1) as f64;
                        t - log.t[rows - 1] < GAP * period
                    })
            };
            let joins = list.len() > first && list.last().is_some_and(follows);
            if !(block.continues && list.len() > first || joins) {
                list.push(Log {
                    label: source.label(),
                    ..Log::default()
                });
            }
            let rows = block.len();
            let on = block.extra.iter().find(|(name, _)| name == ENABLE);
            let on = on.map_or_else(
                || vec![true; rows],
                |(_, c)| c.iter().map(|x| *x != 0.0).collect(),
            );
            let supply = block.extra.iter().find(|(name, _)| name == SUPPLY);
            let supply = supply.map_or_else(|| vec![1.0; rows], |(_, c)| c.clone());
            if let (Some(log), Some(joint)) = (list.last_mut(), block.joints.into_iter().next()) {
                log.t.extend(block.t);
                log.q.extend(joint.q);
                log.u.extend(joint.voltage.unwrap_or_default());
                log.on.extend(on);
                log.supply.extend(supply);
                log.reference.extend(joint.reference.unwrap_or_default());
            }
            Ok(())
        })?;
        if list[first..].iter().any(|log| log.u.len() != log.t.len()) {
            return Err(DiagnoseError::NoVoltage(source.label()));
        }
    }
    // Shorter than two parabolas there is nothing to simulate.
    list.retain(|log| log.t.len() > 4 * SIDE);
    for log in &mut list {
        log.read_controller();
    }
    // What is found must not hang on the order of the files, and folds dealt in this order have weak and strong motions each.
    let strength = |log: &Log| log.u.iter().map(|u| u * u).sum::<f64>() / log.u.len() as f64;
    list.sort_by(|a, b| (strength(a).total_cmp(&strength(b))).then_with(|| a.label.cmp(&b.label)));
    Ok(list)
}
