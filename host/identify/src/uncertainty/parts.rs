//! The training data in time segments: every estimate is repeated with one segment left out at a time.
//!
//! The same leave-one-out values give the covariance (delete-group jackknife, Shao & Tu 1995, ch. 2) and the
//! cross-validated error. Neither needs a model of the residual's correlation.

use super::jackknife::{PARTS, Refit, joined, part_count, part_of};
use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::options::ModelKind;
use crate::rows::factor::TriangularFactor;
use crate::rows::stream::each_rows;
use rig_numerics::autocorrelation::Autocorrelation;
use rig_numerics::vector::dot_in_order;

/// Every segment's factor per equation, and the correlation times of the weighted fit's residuals.
pub(crate) struct Parts {
    /// By segment, then by equation of the fitted model.
    pub fitted: Vec<Vec<TriangularFactor>>,
    /// By segment, then by joint, torque against motion: the rows that judge estimates.
    pub judged: Vec<Vec<TriangularFactor>>,
    /// Correlation time of each equation's residual, rows.
    pub memory: Vec<f64>,
    /// Rows over all equations.
    pub rows: u64,
    /// Number of independent segments.
    pub count: usize,
}

impl Parts {
    /// Passes once over the rows (twice for the integral model, which is judged by its torque).
    pub(crate) fn collect(problem: &Problem) -> Result<Self, IdentifyError> {
        let full = problem.start_full();
        let (fitted, memories) = sorted(problem, problem.options.model, &full, problem.instants)?;
        let judged = match problem.options.model {
            ModelKind::Differential => fitted.clone(),
            ModelKind::Integral => {
                let mut instants = 0;
                for recording in problem.training {
                    each_rows(
                        *recording,
                        problem.plan,
                        ModelKind::Differential,
                        &mut |rows| {
                            instants += rows.t.len() as u64;
                            Ok(())
                        },
                    )?;
                }
                sorted(problem, ModelKind::Differential, &full, instants)?.0
            }
        };
        let memory: Vec<f64> = memories
            .iter()
            .map(Autocorrelation::correlation_time)
            .collect();
        let longest = memory.iter().copied().fold(1.0, f64::max);
        let count = part_count(problem.instants, longest);
        let join = |parts: Vec<Vec<TriangularFactor>>| {
            let equations = parts.first().map_or(0, Vec::len);
            let by_equation: Vec<Vec<TriangularFactor>> = (0..equations)
                .map(|k| joined(parts.iter().map(|p| p[k].clone()).collect(), count))
                .collect();
            (0..count)
                .map(|g| by_equation.iter().map(|parts| parts[g].clone()).collect())
                .collect()
        };
        Ok(Self {
            fitted: join(fitted),
            judged: join(judged),
            rows: memories.iter().map(Autocorrelation::seen).sum(),
            memory,
            count,
        })
    }

    /// Returns one factor per segment, with the equations at given weights.
    pub(crate) fn weighted(&self, weights: &[f64]) -> Vec<TriangularFactor> {
        self.fitted
            .iter()
            .map(|equations| {
                let columns = equations.first().map_or(0, TriangularFactor::columns);
                let mut all = TriangularFactor::new(columns);
                for (factor, weight) in equations.iter().zip(weights) {
                    all.merge(factor, *weight);
                }
                all
            })
            .collect()
    }

    /// Returns `weights` in units of σ·√(correlation time), by which correlated rows count as fewer independent ones.
    pub(crate) fn tempered(&self, weights: &[f64]) -> Vec<f64> {
        weights
            .iter()
            .zip(&self.memory)
            .map(|(w, m)| w / m.sqrt())
            .collect()
    }

    /// Returns the cross-validated RMS of each joint's torque residual: every segment is predicted from all the others.
    /// Not a number if no torque of the joint is used.
    pub(crate) fn cross_validated(&self, full: &Refit) -> Vec<f64> {
        let joints = self.judged.first().map_or(0, Vec::len);
        (0..joints)
            .map(|j| {
                let (mut squares, mut rows) = (0.0, 0);
                for (part, values) in self.judged.iter().zip(&full.without) {
                    squares += part[j].residual_squares(values);
                    rows += part[j].rows();
                }
                (squares / rows as f64).sqrt()
            })
            .collect()
    }

    /// Returns the RMS of each joint's torque over the judged rows.
    pub(crate) fn torque_rms(&self) -> Vec<f64> {
        let joints = self.judged.first().map_or(0, Vec::len);
        (0..joints)
            .map(|j| {
                let (squares, rows) = self.judged.iter().fold((0.0, 0), |(s, r), part| {
                    (s + part[j].right_side_squares(), r + part[j].rows())
                });
                (squares / rows.max(1) as f64).sqrt()
            })
            .collect()
    }
}

fn sorted(
    problem: &Problem,
    model: ModelKind,
    full: &[f64],
    total: u64,
) -> Result<(Vec<Vec<TriangularFactor>>, Vec<Autocorrelation>), IdentifyError> {
    let p = problem.base.len();
    let equations = problem.robot.joints.len();
    let mut parts = vec![vec![TriangularFactor::new(p); equations]; PARTS];
    let mut memories = vec![Autocorrelation::default(); equations];
    let mut index = 0;
    for (recording, weight) in problem.training.iter().zip(problem.recording_weights()) {
        each_rows(*recording, problem.plan, model, &mut |rows| {
            for i in 0..rows.t.len() {
                let part = &mut parts[part_of(index, total)];
                for (k, equation) in rows.equations.iter().enumerate() {
                    if equation.keep[i] {
                        let x = &equation.x[i * p..(i + 1) * p];
                        part[k].push(x, equation.y[i], weight);
                        memories[k].push(equation.y[i] - dot_in_order(x, full));
                    }
                }
                index += 1;
            }
            Ok(())
        })?;
    }
    Ok((parts, memories))
}
