//! The torque-rate lead: how long before it acts the torque was recorded.
//!
//! A controller holds its torque until its next sample. So the torque recorded with a position acts, on average, half a
//! period later (Franklin, Powell and Workman 1998, section 4.3). A torque behind a filter or a bus is recorded after it
//! acted. With a lead l the torque differs by l·τ̇. Friction and inertia absorb this, and their errors exceed their
//! intervals. So the torque rate is fitted as a regressor beside all parameters, joint by joint. The rate is a symmetric
//! difference, so noise of the torque does not bias it. Rows are excluded that the low-pass spreads a reversal of the
//! joint over, or of a motor that moves it, because torque and friction error jump together there.
//!
//! A lead that is small against what else is left must be common to the joints, and slow rows must be far: friction
//! near standstill looks like a lead of a few milliseconds. A lead of one joint must explain half of what is left there.
//!
//! The rate is the first order of a shift, so such a lead is undone by interpolation and must still explain half.
//!
//! Limits: a lead of more than four of the fit's rows is not measured. Position noise that a controller feeds back into
//! the torque can make a lead look several times longer.

use std::f64::consts::PI;

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
/// Largest share of a joint's residual variance that its own lead leaves.
const LEFT: f64 = 0.5;
/// Smallest lead that is reported, as a share of the recording's sample period.
const LEAST: f64 = 0.1;
/// Largest number of instants used, evenly spread over all recordings.
const ENOUGH: u64 = 10_000;
/// Number of neighbours on each side for the torque rate. An ideal differentiator with a Hamming window of this length
/// is accurate to a tenth up to four fifths of half the rows' rate; above that the rows' filter passes nothing.
const NEIGHBOURS: usize = 8;

/// A torque-rate lead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lag {
    /// Joint that has it alone; `None` if it is common to all.
    pub joint: Option<usize>,
    /// Time by which the torque was recorded before it acts, s; negative if after.
    pub lead: f64,
    /// Standard deviation, s; a common one includes the differences between joints.
    pub std: f64,
}

/// The torque-rate lead of one joint's equation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Own {
    joint: usize,
    /// Time by which the torque was recorded before it acts, s.
    lead: f64,
    /// Its variance, s².
    variance: f64,
    /// Share of the residual variance that it leaves.
    left: f64,
}

impl Lag {
    /// Estimates the lead from `problem`'s recordings; `memory` has the correlation time of each joint's residual in
    /// rows. None if the lead is not significant.
    pub(crate) fn of(problem: &Problem, memory: &[f64]) -> Result<Option<Self>, IdentifyError> {
        let treatment = problem.plan.treatment;
        // A user-set lead is already known.
        if treatment.torque_lead != 0.0 {
            return Ok(None);
        }
        let joints = problem.robot.joints.len();
        let mut found = common(&leads(problem, memory, NEIGHBOURS)?, joints);
        if found.is_none() {
            for own in likely(&leads(problem, memory, 0)?) {
                if found.is_none() && left_without(problem, own)? < LEFT {
                    found = Some(own.lag());
                }
            }
        }
        Ok(found.filter(|lag| lag.lead.abs() >= LEAST * treatment.dt()))
    }
}

/// Returns the lead of each joint's equation by the rows that have no slow one among `far` neighbours on each side.
fn leads(problem: &Problem, memory: &[f64], far: usize) -> Result<Vec<Own>, IdentifyError> {
    let p = problem.base.len();
    let mut factors = vec![TriangularFactor::new(p + 1); problem.robot.joints.len()];
    let period = row_period(problem);
    let mut row = vec![0.0; p + 1];
    let step = each_row(problem, far, &mut |j, x, y, weight| {
        row[..p].copy_from_slice(x);
        row[p] = rate(y) / period;
        factors[j].push(&row, y[NEIGHBOURS], weight);
    })?;
    Ok((factors.iter().zip(memory).enumerate())
        .filter_map(|(j, (factor, memory))| own(j, factor, (memory / step as f64).max(1.0)))
        .collect())
}

/// Returns the share of the residual variance of one joint's equation that is left if its lead is undone.
fn left_without(problem: &Problem, own: &Own) -> Result<f64, IdentifyError> {
    let rows = own.lead / row_period(problem);
    if rows.abs() > NEIGHBOURS as f64 / 2.0 {
        return Ok(1.0);
    }
    let width = problem.base.len() + 1;
    let mut both = [(); 2].map(|()| TriangularFactor::new(width - 1));
    each_row(problem, 0, &mut |j, x, y, weight| {
        if j == own.joint {
            both[0].push(x, y[NEIGHBOURS], weight);
            both[1].push(x, between(y, -rows), weight);
        }
    })?;
    let [recorded, without] = both.map(|factor| factor.triangle()[width * width - 1].powi(2));
    Ok(without / recorded)
}

fn row_period(problem: &Problem) -> f64 {
    let treatment = problem.plan.treatment;
    treatment.decimation as f64 * treatment.dt()
}

/// Calls `each` with the joint, regressors, torques of the rows around (the row itself is number [`NEIGHBOURS`]) and
/// weight of the rows that have no slow one among `far` neighbours on each side and no reversal near. Returns the step
/// between rows that are looked at.
fn each_row(
    problem: &Problem,
    far: usize,
    each: &mut dyn FnMut(usize, &[f64], &[f64], f64),
) -> Result<u64, IdentifyError> {
    let p = problem.base.len();
    let step = problem.instants.div_ceil(ENOUGH).max(1);
    let period = row_period(problem);
    let mut reversals = Reversals::of(problem.plan);
    problem.each_instant(step, &mut |rows, i, weight| {
        if !has_neighbours(rows, i, period) {
            return Ok(());
        }
        let reverses = reversals.near(rows, i)?;
        for (j, (equation, reverses)) in rows.equations.iter().zip(reverses).enumerate() {
            if !*reverses && equation.keep[i - far..=i + far].iter().all(|keep| *keep) {
                let around = &equation.y[i - NEIGHBOURS..=i + NEIGHBOURS];
                each(j, &equation.x[i * p..(i + 1) * p], around, weight);
            }
        }
        Ok(())
    })?;
    Ok(step)
}

/// Returns true if the rows around row `i` follow each other without a gap.
fn has_neighbours(rows: &Rows, i: usize, period: f64) -> bool {
    let first = i.checked_sub(NEIGHBOURS).and_then(|k| rows.t.get(k));
    let last = rows.t.get(i + NEIGHBOURS);
    first
        .zip(last)
        .is_some_and(|(first, last)| last - first < (2.0 * NEIGHBOURS as f64 + 0.5) * period)
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

/// Returns the rate of change at the middle row, per row.
fn rate(y: &[f64]) -> f64 {
    let weight = |k: usize| {
        let sign = if k.is_multiple_of(2) { -1.0 } else { 1.0 };
        sign * window(k as f64, NEIGHBOURS) / k as f64
    };
    (1..=NEIGHBOURS)
        .map(|k| weight(k) * (y[NEIGHBOURS + k] - y[NEIGHBOURS - k]))
        .sum()
}

/// Returns the value `rows` behind the middle row, at most half of the neighbours away, by a windowed sinc.
fn between(y: &[f64], rows: f64) -> f64 {
    let reach = NEIGHBOURS / 2;
    let near = (NEIGHBOURS as i64 + rows.round() as i64) as usize;
    let rest = rows - rows.round();
    let weight = |k: usize| {
        let away = k as f64 - near as f64 - rest;
        let sinc = if away == 0.0 {
            1.0
        } else {
            (PI * away).sin() / (PI * away)
        };
        sinc * window(away, reach)
    };
    let weights = (near - reach..=near + reach).map(|k| (weight(k), y[k]));
    let (sum, all) = weights.fold((0.0, 0.0), |(sum, all), (w, y)| (sum + w * y, all + w));
    sum / all
}

/// Returns the Hamming window of `reach` rows on each side, `away` rows from its middle.
fn window(away: f64, reach: usize) -> f64 {
    0.54 + 0.46 * (PI * away / (reach + 1) as f64).cos()
}

/// Returns the lead of joint `j`: least squares for the last column beside all others, of any rank.
fn own(j: usize, factor: &TriangularFactor, memory: f64) -> Option<Own> {
    let (width, rows) = (factor.columns() + 1, factor.rows());
    let freedom = rows.saturating_sub(width as u64) as f64;
    let r = factor.triangle();
    let (c, y) = (width - 2, width - 1);
    let column = r[c * width + c];
    let [explained, rest] = [c, y].map(|row| r[y * width + row].powi(2));
    (freedom > 0.0 && column != 0.0).then(|| Own {
        joint: j,
        lead: r[y * width + c] / column,
        variance: rest / freedom * memory / column.powi(2),
        left: rest / (explained + rest),
    })
}

/// Returns a lead common to all `joints`. With several it must stay significant without the joint of smallest
/// variance: a wrong friction law of one joint looks like a lead there alone.
fn common(own: &[Own], joints: usize) -> Option<Lag> {
    let all = together(own)?;
    let least = |a: &&Own, b: &&Own| a.variance.total_cmp(&b.variance);
    let loudest = own.iter().min_by(least)?.joint;
    let others: Vec<Own> = (own.iter().copied())
        .filter(|own| own.joint != loudest)
        .collect();
    let agreed = match together(&others) {
        Some(rest) => {
            rest.is_seen(SEEN_BY_THE_OTHERS)
                && rest.lead.is_sign_positive() == all.lead.is_sign_positive()
        }
        None => joints == 1,
    };
    (all.is_seen(SEEN) && agreed).then_some(all)
}

/// Returns the significant leads that explain most of what is left at their joint, the most significant first.
fn likely(own: &[Own]) -> Vec<&Own> {
    let times = |own: &Own| own.lead.abs() / own.lag().std;
    let mut all: Vec<&Own> = (own.iter())
        .filter(|own| own.left < LEFT && own.lag().is_seen(SEEN))
        .collect();
    all.sort_by(|a, b| times(b).total_cmp(&times(a)));
    all
}

impl Lag {
    /// Returns true if the lead is at least this number of standard deviations.
    fn is_seen(&self, times: f64) -> bool {
        self.lead.abs() >= times * self.std
    }
}

impl Own {
    fn lag(&self) -> Lag {
        Lag {
            joint: Some(self.joint),
            lead: self.lead,
            std: self.variance.sqrt(),
        }
    }
}

/// Returns the mean of the leads by inverse variance; its variance includes the joints' differences (Birge 1932).
fn together(own: &[Own]) -> Option<Lag> {
    let sum: f64 = own.iter().map(|own| 1.0 / own.variance).sum();
    let lead = own.iter().map(|own| own.lead / own.variance).sum::<f64>() / sum;
    let squares: f64 = (own.iter())
        .map(|own| (own.lead - lead).powi(2) / own.variance)
        .sum();
    let widened = (squares / (own.len().max(2) - 1) as f64).max(1.0);
    lead.is_finite().then(|| Lag {
        joint: None,
        lead,
        std: (widened / sum).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leads(all: &[[f64; 2]]) -> Vec<Own> {
        let one = |(joint, [lead, variance]): (usize, &[f64; 2])| Own {
            joint,
            lead: *lead,
            variance: *variance,
            left: 0.9,
        };
        all.iter().enumerate().map(one).collect()
    }

    #[test]
    fn joints_that_differ_make_a_lag_less_sure() {
        let of = |all: &[[f64; 2]]| together(&leads(all)).map_or([0.0; 2], |l| [l.lead, l.std]);
        let same = of(&[[1e-3, 1e-10], [1e-3, 1e-10]]);
        assert!((same[0] - 1e-3).abs() < 1e-12 && (same[1] - 1e-5 / 2f64.sqrt()).abs() < 1e-12);
        let other = of(&[[2e-3, 1e-10], [0.0, 1e-10]]);
        assert!((other[0] - 1e-3).abs() < 1e-12 && other[1] > 0.9e-3);
        assert_eq!(together(&[]), None);
    }

    #[test]
    fn a_common_lead_is_not_that_of_one_joint() {
        let all = |all: &[[f64; 2]]| common(&leads(all), all.len()).is_some();
        assert!(all(&[[1e-3, 1e-10]]));
        assert!(all(&[[1e-3, 1e-10], [0.9e-3, 1e-8], [1.1e-3, 1e-8]]));
        // Values of an arm with screws whose torque and motion are simultaneous.
        let geared = [
            [0.826e-3, 1.3e-9],
            [-0.105e-3, 1.0e-7],
            [1.230e-3, 6.4e-8],
            [0.034e-3, 2.6e-8],
        ];
        assert!(!all(&geared));
        assert!(!all(&[[1e-3, 1e-10], [-0.9e-3, 1e-9]]));
        // The other joint of an arm shows nothing.
        assert_eq!(common(&leads(&[[1e-3, 1e-10]]), 2), None);
    }

    #[test]
    fn rows_between_rows_are_those_of_a_smooth_torque() {
        let torque = |k: f64| 2.0 + (0.9 * k).sin() - 0.4 * (0.3 * k).cos();
        let around: Vec<f64> = (0..=2 * NEIGHBOURS).map(|k| torque(k as f64)).collect();
        for rows in [-3.7, -1.0, -0.3, 0.0, 0.5, 2.2] {
            let error = between(&around, rows) - torque(NEIGHBOURS as f64 + rows);
            assert!(error.abs() < 0.02, "{rows}: {error}");
        }
        let slope = 0.9 * (0.9 * 8.0f64).cos() + 0.12 * (0.3 * 8.0f64).sin();
        assert!((rate(&around) - slope).abs() < 0.01);
    }
}
