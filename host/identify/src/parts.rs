//! The training data in time segments: every estimate is repeated with one segment left out at a time.
//!
//! The same leave-one-out values give the covariance (delete-group jackknife, Shao & Tu 1995, ch. 2) and the
//! cross-validated error. Neither needs a model of the residual's correlation.

use nalgebra::{DMatrix, DVector};

use super::covariance::Memory;
use super::factor::TriangularFactor;
use super::linear::product;
use super::model::each_rows;
use super::problem::Problem;
use super::{IdentifyError, ModelKind};

/// Number of segments of the training data.
pub(super) const PARTS: usize = 16;
/// Minimum length of a segment, in correlation times of the residual; shorter neighbours are joined.
const MEMORIES_PER_PART: f64 = 10.0;
/// Smallest number of segments after joining.
const FEWEST_PARTS: usize = 8;

/// Returns the segment of instant `index` among `total`.
pub(super) fn part_of(index: u64, total: u64) -> usize {
    ((u128::from(index) * PARTS as u128 / u128::from(total.max(1))) as usize).min(PARTS - 1)
}

/// Returns the number of segments that are independent enough.
pub(super) fn part_count(instants: u64, memory_rows: f64) -> usize {
    if instants as f64 >= PARTS as f64 * MEMORIES_PER_PART * memory_rows {
        PARTS
    } else {
        FEWEST_PARTS
    }
}

/// Joins neighbours to `count` segments, one factor each.
pub(super) fn joined(parts: Vec<TriangularFactor>, count: usize) -> Vec<TriangularFactor> {
    let each = parts.len().div_ceil(count.max(1)).max(1);
    parts
        .chunks(each)
        .map(|chunk| {
            let mut whole = chunk[0].clone();
            for other in &chunk[1..] {
                whole.merge(other, 1.0);
            }
            whole
        })
        .collect()
}

/// Factor of all segments, and of all but each one.
pub(super) struct LeaveOut {
    /// All segments.
    pub whole: TriangularFactor,
    /// All but the segment of this index.
    pub without: Vec<TriangularFactor>,
}

impl LeaveOut {
    /// Merges from both ends: three merges per segment.
    pub(super) fn of(parts: &[TriangularFactor]) -> Self {
        let columns = parts.first().map_or(0, TriangularFactor::columns);
        let empty = TriangularFactor::new(columns);
        let mut before = vec![empty.clone()];
        for part in parts {
            let mut next = before[before.len() - 1].clone();
            next.merge(part, 1.0);
            before.push(next);
        }
        let mut after = empty;
        let mut without = Vec::with_capacity(parts.len());
        for (k, part) in parts.iter().enumerate().rev() {
            let mut rest = before[k].clone();
            rest.merge(&after, 1.0);
            without.push(rest);
            after.merge(part, 1.0);
        }
        without.reverse();
        Self {
            whole: before[parts.len()].clone(),
            without,
        }
    }

    /// Repeats a fit on all segments and on each remainder.
    pub(super) fn refit(
        &self,
        fit: &dyn Fn(&TriangularFactor) -> Result<Vec<f64>, IdentifyError>,
    ) -> Result<Refit, IdentifyError> {
        Ok(Refit {
            whole: fit(&self.whole)?,
            without: self.without.iter().map(fit).collect::<Result<_, _>>()?,
        })
    }
}

/// Values from all data and with each segment left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Refit {
    /// From all data.
    pub whole: Vec<f64>,
    /// Without one segment.
    pub without: Vec<Vec<f64>>,
}

impl Refit {
    /// Applies a function to every set of values.
    pub(super) fn map(&self, of: &dyn Fn(&[f64]) -> Vec<f64>) -> Self {
        Self {
            whole: of(&self.whole),
            without: self.without.iter().map(|v| of(v)).collect(),
        }
    }

    /// Returns the delete-group jackknife covariance.
    pub(super) fn covariance(&self) -> DMatrix<f64> {
        let (size, groups) = (self.whole.len(), self.without.len() as f64);
        let mut mean = DVector::zeros(size);
        for v in &self.without {
            mean += DVector::from_column_slice(v) / groups;
        }
        let mut covariance = DMatrix::zeros(size, size);
        for v in &self.without {
            let d = DVector::from_column_slice(v) - &mean;
            covariance.ger(1.0, &d, &d, 1.0);
        }
        covariance * ((groups - 1.0) / groups)
    }
}

/// Every segment's factor per equation, and the correlation times of the weighted fit's residuals.
pub(super) struct Parts {
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
    pub(super) fn collect(problem: &Problem) -> Result<Self, IdentifyError> {
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
        let memory: Vec<f64> = memories.iter().map(Memory::length).collect();
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
            rows: memories.iter().map(Memory::seen).sum(),
            memory,
            count,
        })
    }

    /// Returns one factor per segment, with the equations at given weights.
    pub(super) fn weighted(&self, weights: &[f64]) -> Vec<TriangularFactor> {
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

    /// Returns the cross-validated RMS of each joint's torque residual: every segment is predicted from all the others.
    /// Not a number if no torque of the joint is used.
    pub(super) fn cross_validated(&self, full: &Refit) -> Vec<f64> {
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
    pub(super) fn torque_rms(&self) -> Vec<f64> {
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
) -> Result<(Vec<Vec<TriangularFactor>>, Vec<Memory>), IdentifyError> {
    let p = problem.base.len();
    let equations = problem.robot.joints.len();
    let mut parts = vec![vec![TriangularFactor::new(p); equations]; PARTS];
    let mut memories = vec![Memory::default(); equations];
    let mut index = 0;
    for (recording, weight) in problem.training.iter().zip(problem.recording_weights()) {
        each_rows(*recording, problem.plan, model, &mut |rows| {
            for i in 0..rows.t.len() {
                let part = &mut parts[part_of(index, total)];
                for (k, equation) in rows.equations.iter().enumerate() {
                    if equation.keep[i] {
                        let x = &equation.x[i * p..(i + 1) * p];
                        part[k].push(x, equation.y[i], weight);
                        memories[k].push(equation.y[i] - product(x, full));
                    }
                }
                index += 1;
            }
            Ok(())
        })?;
    }
    Ok((parts, memories))
}
