//! Recordings for a voltage-driven simulation: rows as written, without filter or even grid.

use crate::DiagnoseError;
use crate::voltage::law::Law;
use rig_data::prepare::Recording;
use rig_model::robot::VoltageController;

/// Rows on each side for the velocity at a row: a parabola through eleven rows.
const SIDE: usize = 5;
/// The same for a reference without noise: a parabola through five rows.
const REFERENCE_SIDE: usize = 2;
/// Row distance, in periods, above which there is a gap; a closer voltage is known well enough.
const GAP: f64 = 5.0;
/// Column that shows whether the drive is on.
const ENABLE: &str = "torque_enable";
/// Column of the supply's voltage.
const SUPPLY: &str = "supply";

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

    /// Identifies the controller from the rows.
    pub(crate) fn read_controller(&mut self) {
        self.read_slopes();
        if let Some(law) = Law::of(self) {
            (self.law, self.integral) = (Some(law.controller), law.integral);
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

/// Reads the first joint of `recordings`.
///
/// # Errors
/// Errors of reading; a recording without a voltage.
pub(crate) fn logs(recordings: &[&dyn Recording]) -> Result<Vec<Log>, DiagnoseError> {
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
    // A log shorter than two parabolas is not simulated.
    list.retain(|log| log.t.len() > 4 * SIDE);
    for log in &mut list {
        log.read_controller();
    }
    // The result must not depend on the order of the files. In this order, folds have weak and strong motions each.
    let strength = |log: &Log| log.u.iter().map(|u| u * u).sum::<f64>() / log.u.len() as f64;
    list.sort_by(|a, b| (strength(a).total_cmp(&strength(b))).then_with(|| a.label.cmp(&b.label)));
    Ok(list)
}
