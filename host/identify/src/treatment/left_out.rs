//! Comparison of treatments by how well they predict time segments that were left out of the fit.

use crate::error::IdentifyError;
use crate::estimators::linear::by_noise;
use crate::options::ModelKind;
use crate::rows::equation::Rows;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use crate::uncertainty::jackknife::LeaveOut;
use rig_data::prepare::Recording;
use rig_numerics::statistics::mean_or_zero;

/// Number of segments that are left out in turn.
const STRETCHES: usize = 8;
/// Reduction of the mean log error of the joints above which a treatment with fewer rows is better.
pub(crate) const BETTER: f64 = 0.02;

/// Rows of the equations, by segment, then by joint.
pub(crate) struct Stretches(Vec<Vec<TriangularFactor>>);

impl Stretches {
    /// Sorts the rows of the recordings for which `used` (arguments: rows, joint, row) is true.
    ///
    /// # Errors
    /// [`IdentifyError`]: recordings that cannot be read.
    pub(crate) fn of(
        recordings: &[&dyn Recording],
        plan: &Plan,
        used: &dyn Fn(&Rows, usize, usize) -> bool,
    ) -> Result<Self, IdentifyError> {
        let p = plan.columns.len();
        let empty = vec![TriangularFactor::new(p); plan.loudness.len()];
        let mut sorted = vec![empty; STRETCHES];
        for recording in recordings {
            let [mut start, mut end] = [f64::INFINITY, f64::NEG_INFINITY];
            each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
                start = rows.t.first().map_or(start, |t| start.min(*t));
                end = rows.t.last().map_or(end, |t| end.max(*t));
                Ok(())
            })?;
            let length = (end - start).max(f64::MIN_POSITIVE) / STRETCHES as f64;
            each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
                for (i, t) in rows.t.iter().enumerate() {
                    let stretch = (((t - start) / length) as usize).min(STRETCHES - 1);
                    let factors = sorted[stretch].iter_mut().zip(&rows.equations);
                    for (j, (factor, equation)) in factors.enumerate() {
                        if used(rows, j, i) {
                            factor.push(&equation.x[i * p..(i + 1) * p], equation.y[i], 1.0);
                        }
                    }
                }
                Ok(())
            })?;
        }
        Ok(Self(sorted))
    }

    /// Returns the mean log RMS error of the joints: each segment of `judge`, predicted from the other segments here.
    pub(crate) fn error(&self, judge: &Self) -> f64 {
        let joints = self.0.first().map_or(0, Vec::len);
        let without = |j: usize| {
            let own: Vec<TriangularFactor> = self.0.iter().map(|list| list[j].clone()).collect();
            LeaveOut::of(&own).without
        };
        let without: Vec<Vec<TriangularFactor>> = (0..joints).map(without).collect();
        let (mut squares, mut rows) = (vec![0.0; joints], vec![0u64; joints]);
        for (out, judge) in judge.0.iter().enumerate() {
            let rest: Vec<TriangularFactor> = without.iter().map(|own| own[out].clone()).collect();
            let Some(beta) = by_noise(&rest) else {
                return f64::INFINITY;
            };
            for (j, factor) in judge.iter().enumerate().filter(|(_, f)| f.rows() > 0) {
                squares[j] += factor.residual_squares(&beta);
                rows[j] += factor.rows();
            }
        }
        let moving: Vec<f64> = (squares.iter().zip(&rows))
            .filter(|(s, rows)| **rows > 0 && **s > 0.0)
            .map(|(s, rows)| 0.5 * (s / *rows as f64).ln())
            .collect();
        mean_or_zero(&moving)
    }
}
