//! How long before it acts the torque was recorded.
//!
//! A controller holds its torque until its next sample: what is recorded with a position acts, on average, half a period
//! after it (Franklin, Powell and Workman 1998, section 4.3). A torque l earlier than it acts differs from it by l·τ̇, which
//! friction and inertia take up, each by more than its interval. So the torque's own rate stands beside all parameters here,
//! and what it explains is said. Rows about a reversal have no part in it: torque and the error of a friction's law leap there
//! together. By symmetric differences, noise of the torque has no part in it.
//!
//! Leaves out: lags that differ from joint to joint; what is more than a few samples, of which only that it is there is told; noise of
//! the position, which a controller feeds back into the torque and which makes a lead look up to some times longer.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use super::IdentifyError;
use super::factor::TriangularFactor;
use super::model::Rows;
use super::problem::Problem;

/// Standard deviations from which a lag counts.
const SEEN: f64 = 5.0;
/// … and for all joints but the one that says most.
const SEEN_BY_THE_OTHERS: f64 = 3.0;
/// Share of a sample of the recording below which it is not worth a word.
const LEAST: f64 = 0.1;
/// Instants that are looked at, evenly spread over all recordings.
const ENOUGH: u64 = 10_000;
/// Neighbours on each side that the rate is taken from: the ideal differentiator behind a Hamming window of so many is good
/// to within a tenth up to four fifths of half the rows' rate, beyond which their filter leaves nothing.
const NEIGHBOURS: usize = 8;

/// A lag of all joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lag {
    /// How long before it acts the torque was recorded, s; negative: after.
    pub lead: f64,
    /// Standard deviation, s: what the joints' own differ by counts.
    pub std: f64,
}

impl Lag {
    /// What `problem`'s recordings show; `memory` has, for each joint, the rows that its residual remembers. None where they show
    /// none that matters.
    pub(super) fn of(problem: &Problem, memory: &[f64]) -> Result<Option<Self>, IdentifyError> {
        // Who gave one knows of it.
        if problem.plan.treatment.torque_lead != 0.0 {
            return Ok(None);
        }
        let p = problem.base.len();
        let mut factors = vec![TriangularFactor::new(p + 1); problem.robot.joints.len()];
        let step = problem.instants.div_ceil(ENOUGH).max(1);
        let treatment = problem.plan.treatment;
        let period = treatment.decimation as f64 * treatment.dt();
        let mut row = vec![0.0; p + 1];
        problem.each_instant(step, &mut |rows, i, weight| {
            let Some(about) = neighbours(rows, i, period) else {
                return Ok(());
            };
            let equations = rows.equations.iter().zip(&mut factors);
            for (equation, factor) in
                equations.filter(|(e, _)| e.keep[about.clone()].iter().all(|k| *k))
            {
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

    /// In words; `sample` is the recording's, s.
    pub(super) fn said(&self, sample: f64) -> String {
        let samples = self.lead / sample;
        let size = format!(
            "{:.2} ms ({:.1} samples)",
            1e3 * self.lead.abs(),
            samples.abs()
        );
        let (what, mend) = if samples < 0.0 {
            (
                format!("was recorded some {size} after it acted, as behind a filter"),
                "If it was, give both by one clock, or that time, negative, as --torque-lead"
                    .to_owned(),
            )
        } else {
            let hold = format!(
                "If the recorded torque is a command that is held until the next, give half a sample, --torque-lead {}",
                rig_output::format_significant(0.5 * sample, 2)
            );
            (format!("was recorded some {size} before it acts"), hold)
        };
        format!(
            "What is left of the torque goes with its rate of change, as if it {what} (noise of the position that a controller feeds back makes that look longer): inertia and friction are then off by more than their intervals say. {mend}."
        )
    }
}

/// The rows about row `i`, where they follow each other without a gap.
fn neighbours(rows: &Rows, i: usize, period: f64) -> Option<RangeInclusive<usize>> {
    let first = i.checked_sub(NEIGHBOURS)?;
    let last = i + NEIGHBOURS;
    let span = rows.t.get(last)? - rows.t[first];
    (span < (2.0 * NEIGHBOURS as f64 + 0.5) * period).then_some(first..=last)
}

/// Rate of change at row `i`, a row.
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

/// Lead of one joint and its variance: least squares for the last column beside all others, whatever their rank.
fn own(factor: &TriangularFactor, memory: f64) -> Option<[f64; 2]> {
    let (width, rows) = (factor.columns() + 1, factor.rows());
    let freedom = rows.saturating_sub(width as u64) as f64;
    let r = factor.triangle();
    let (c, y) = (width - 2, width - 1);
    let column = r[c * width + c];
    let deviation = r[y * width + y].powi(2) / freedom * memory / column.powi(2);
    (freedom > 0.0 && column != 0.0).then(|| [r[y * width + c] / column, deviation])
}

/// One lead that all show: every joint but the one that says most must still show it, where there are several. A law of one
/// joint that is not quite right looks like a lead there alone.
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

/// One lead for all: mean by inverse variance, its variance widened by what the joints differ (Birge 1932).
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
        // As an arm with screws shows whose torque and motion are of one instant.
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
