//! The torque-rate lead: how long before it acts the torque was recorded.
//!
//! A controller holds its torque until its next sample. So the torque recorded with a position acts, on average, half a
//! period later (Franklin, Powell and Workman 1998, section 4.3). With a lead l the torque differs by l·τ̇. Friction
//! and inertia absorb this, and their errors exceed their intervals. So the torque rate is fitted as a regressor beside
//! all parameters. Rows near a reversal are excluded, because torque and friction error jump together there: those with
//! a slow row among the neighbours, and those that the low-pass spreads a reversal of the joint, or of a motor that moves
//! it, over. A fast reversal may fall between two rows. The rate is a symmetric difference, so noise of the torque does
//! not bias it.
//!
//! Limits: one lead for all joints; a lead of more than a few samples is detected but not measured. Position noise that
//! a controller feeds back into the torque can make a lead look several times longer.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use crate::error::{IdentifyError, failed};
use crate::estimators::problem::Problem;
use crate::rows::differential::RESPONSE;
use crate::rows::equation::Rows;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use rig_data::prepare::PrepareError;

/// Number of standard deviations above which a lead is significant.
const SEEN: f64 = 5.0;
/// The same for all joints except the one with the smallest standard deviation.
const SEEN_BY_THE_OTHERS: f64 = 3.0;
/// Smallest lead that is reported, as a share of the recording's sample period.
const LEAST: f64 = 0.1;
/// Largest number of instants used, evenly spread over all recordings.
const ENOUGH: u64 = 10_000;
/// Number of neighbours on each side for the torque rate. An ideal differentiator with a Hamming window of this length
/// is accurate to a tenth up to four fifths of half the rows' rate; above that the rows' filter passes nothing.
const NEIGHBOURS: usize = 8;

/// A torque-rate lead common to all joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lag {
    /// Time by which the torque was recorded before it acts, s; negative if after.
    pub lead: f64,
    /// Standard deviation, s; includes the differences between joints.
    pub std: f64,
}

impl Lag {
    /// Estimates the lead from `problem`'s recordings; `memory` has the correlation time of each joint's residual in
    /// rows. None if the lead is not significant.
    pub(crate) fn of(problem: &Problem, memory: &[f64]) -> Result<Option<Self>, IdentifyError> {
        // A user-set lead is already known.
        if problem.plan.treatment.torque_lead != 0.0 {
            return Ok(None);
        }
        let p = problem.base.len();
        let mut factors = vec![TriangularFactor::new(p + 1); problem.robot.joints.len()];
        let step = problem.instants.div_ceil(ENOUGH).max(1);
        let treatment = problem.plan.treatment;
        let period = treatment.decimation as f64 * treatment.dt();
        let mut row = vec![0.0; p + 1];
        let mut reversals = Reversals::of(problem.plan);
        problem.each_instant(step, &mut |rows, i, weight| {
            let Some(about) = neighbours(rows, i, period) else {
                return Ok(());
            };
            let reverses = reversals.near(rows, i)?;
            let equations = rows.equations.iter().zip(&mut factors).zip(reverses);
            for ((equation, factor), _) in equations.filter(|((e, _), reverses)| {
                !**reverses && e.keep[about.clone()].iter().all(|k| *k)
            }) {
                row[..p].copy_from_slice(&equation.x[i * p..(i + 1) * p]);
                row[p] = rate(&equation.y, i) / period;
                factor.push(&row, equation.y[i], weight);
            }
            Ok(())
        })?;
        let own = factors
            .iter()
            .zip(memory)
            .filter_map(|(factor, memory)| own(factor, (memory / step as f64).max(1.0)));
        Ok(shown(&own.collect::<Vec<_>>()).filter(|lag| lag.lead.abs() >= LEAST * treatment.dt()))
    }
}

/// Returns the rows around row `i` if they follow each other without a gap.
fn neighbours(rows: &Rows, i: usize, period: f64) -> Option<RangeInclusive<usize>> {
    let first = i.checked_sub(NEIGHBOURS)?;
    let last = i + NEIGHBOURS;
    let span = rows.t.get(last)? - rows.t[first];
    (span < (2.0 * NEIGHBOURS as f64 + 0.5) * period).then_some(first..=last)
}

/// Finds the joints that reverse, or that a reversing motor moves, so near to a row that the low-pass spreads the reversal
/// over it.
struct Reversals<'a> {
    plan: &'a Plan<'a>,
    /// Per joint.
    found: Vec<bool>,
    q: Vec<f64>,
    /// Per motor, its speed by the speeds of the joints.
    directions: Vec<f64>,
    /// Speed of each motor in the first of the rows.
    first: Vec<f64>,
}

impl<'a> Reversals<'a> {
    fn of(plan: &'a Plan) -> Self {
        let n = plan.loudness.len();
        Self {
            plan,
            found: vec![false; n],
            q: vec![0.0; n],
            directions: vec![0.0; n * n],
            first: vec![0.0; n],
        }
    }

    /// Returns, per joint, true if row `i` is near a reversal.
    fn near(&mut self, rows: &Rows, i: usize) -> Result<&[bool], PrepareError> {
        let near = i.saturating_sub(RESPONSE)..(i + RESPONSE + 1).min(rows.t.len());
        for (found, speeds) in self.found.iter_mut().zip(&rows.qd) {
            let speeds = &speeds[near.clone()];
            *found = speeds.iter().any(|v| v * speeds[0] <= 0.0);
        }
        if !self.plan.transmission.is_simple() {
            for row in near.clone() {
                self.add_motors(rows, row, row == near.start)?;
            }
        }
        Ok(&self.found)
    }

    /// Adds the joints whose motors turn against the `first` row.
    fn add_motors(&mut self, rows: &Rows, row: usize, first: bool) -> Result<(), PrepareError> {
        let n = self.q.len();
        for (to, q) in self.q.iter_mut().zip(&rows.q) {
            *to = q[row];
        }
        (self.plan.transmission)
            .motor_directions(&self.q, &mut self.directions)
            .map_err(failed)?;
        for (along, start) in self.directions.chunks_exact(n).zip(&mut self.first) {
            let each = along.iter().zip(&rows.qd);
            let speed: f64 = each.map(|(a, qd)| a * qd[row]).sum();
            if first {
                *start = speed;
            }
            if speed * *start <= 0.0 {
                // A simple drive moves nothing here: its friction is the joint's.
                for (found, a) in self.found.iter_mut().zip(along) {
                    *found |= *a != 0.0;
                }
            }
        }
        Ok(())
    }
}

/// Returns the rate of change at row `i`, per row.
fn rate(y: &[f64], i: usize) -> f64 {
    let weight = |k: usize| {
        let window = 0.54 + 0.46 * (PI * k as f64 / (NEIGHBOURS + 1) as f64).cos();
        let sign = if k.is_multiple_of(2) { -1.0 } else { 1.0 };
        sign * window / k as f64
    };
    (1..=NEIGHBOURS)
        .map(|k| weight(k) * (y[i + k] - y[i - k]))
        .sum()
}

/// Returns the lead of a joint and its variance: least squares for the last column beside all others, of any rank.
fn own(factor: &TriangularFactor, memory: f64) -> Option<[f64; 2]> {
    let (width, rows) = (factor.columns() + 1, factor.rows());
    let freedom = rows.saturating_sub(width as u64) as f64;
    let r = factor.triangle();
    let (c, y) = (width - 2, width - 1);
    let column = r[c * width + c];
    let deviation = r[y * width + y].powi(2) / freedom * memory / column.powi(2);
    (freedom > 0.0 && column != 0.0).then(|| [r[y * width + c] / column, deviation])
}

/// Returns a lead common to all joints. With several joints it must stay significant without the joint of smallest
/// variance: a wrong friction law of one joint looks like a lead there alone.
fn shown(own: &[[f64; 2]]) -> Option<Lag> {
    let all = together(own)?;
    let seen = |lag: &Lag, times: f64| lag.lead.abs() >= times * lag.std;
    let loudest = (0..own.len()).min_by(|&a, &b| own[a][1].total_cmp(&own[b][1]))?;
    let others = [&own[..loudest], &own[loudest + 1..]].concat();
    let agreed = together(&others).is_none_or(|rest| {
        seen(&rest, SEEN_BY_THE_OTHERS)
            && rest.lead.is_sign_positive() == all.lead.is_sign_positive()
    });
    (seen(&all, SEEN) && agreed).then_some(all)
}

/// Returns the mean of the leads by inverse variance; its variance includes the joints' differences (Birge 1932).
fn together(own: &[[f64; 2]]) -> Option<Lag> {
    let sum: f64 = own.iter().map(|[_, variance]| 1.0 / variance).sum();
    let lead = own
        .iter()
        .map(|[lead, variance]| lead / variance)
        .sum::<f64>()
        / sum;
    let squares: f64 = (own.iter())
        .map(|[l, variance]| (l - lead).powi(2) / variance)
        .sum();
    let widened = (squares / (own.len().max(2) - 1) as f64).max(1.0);
    lead.is_finite().then(|| Lag {
        lead,
        std: (widened / sum).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_that_differ_make_a_lag_less_sure() {
        let same = together(&[[1e-3, 1e-10], [1e-3, 1e-10]]).unwrap_or(Lag {
            lead: 0.0,
            std: 0.0,
        });
        assert!((same.lead - 1e-3).abs() < 1e-12 && (same.std - 1e-5 / 2f64.sqrt()).abs() < 1e-12);
        let other = together(&[[2e-3, 1e-10], [0.0, 1e-10]]).unwrap_or(same);
        assert!((other.lead - 1e-3).abs() < 1e-12 && other.std > 0.9e-3);
        assert_eq!(together(&[]), None);
    }

    #[test]
    fn one_joint_alone_does_not_make_a_lead() {
        assert!(shown(&[[1e-3, 1e-10]]).is_some());
        assert!(shown(&[[1e-3, 1e-10], [0.9e-3, 1e-8], [1.1e-3, 1e-8]]).is_some());
        // Values of an arm with screws whose torque and motion are simultaneous.
        let geared = [
            [0.826e-3, 1.3e-9],
            [-0.105e-3, 1.0e-7],
            [1.230e-3, 6.4e-8],
            [0.034e-3, 2.6e-8],
        ];
        assert_eq!(shown(&geared), None);
        assert_eq!(shown(&[[1e-3, 1e-10], [-0.9e-3, 1e-9]]), None);
    }
}
