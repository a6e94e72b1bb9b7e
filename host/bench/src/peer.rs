//! Sparse regression methods with the same candidates, for comparison.
//!
//! Sequentially thresholded least squares (STLSQ: Brunton, Proctor, Kutz 2016, PNAS 113:3932, threshold by the
//! hold-out) and forward regression with orthogonal least squares (FROLS: Billings 2013, ch. 3, number of terms by BIC
//! with every sample counted as independent). Both fit the residual torque of the nominal model with columns projected
//! onto its orthogonal complement, in a band of 40 Hz at 100 Hz. `dictionary` uses a small grid of shape parameters.
//!
//! Not covered: backlash and dead time (no column is linear in them), LuGre (three shapes), more than one joint.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;
use rig_shared::effects::Kind;

use super::answer::{Answer, Method, Named};
use super::error::BenchError;
use rig_scenario::Made;

mod dictionary;

use dictionary::Dictionary;

/// Largest number of terms in forward regression.
const MOST: usize = 20;
/// Thresholds that are tried, as shares of the target's norm.
const THRESHOLDS: [f64; 8] = [0.02, 0.04, 0.07, 0.1, 0.15, 0.22, 0.33, 0.5];
/// Largest number of thresholding rounds.
const ROUNDS: usize = 20;

/// Sequentially thresholded least squares.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stlsq;

/// Forward regression with orthogonal least squares.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frols;

impl Method for Stlsq {
    fn name(&self) -> &'static str {
        "STLSQ"
    }

    fn answer(&self, made: &Made, without: &[Kind]) -> Result<Answer, BenchError> {
        let problem = Problem::of(made, without)?;
        let mut best: Option<(f64, Vec<usize>)> = None;
        for threshold in THRESHOLDS {
            let chosen = thresholded(&problem, threshold);
            let unseen = problem.unseen(&chosen);
            if best.as_ref().is_none_or(|(least, _)| unseen < *least) {
                best = Some((unseen, chosen));
            }
        }
        let chosen = best.map_or_else(Vec::new, |(_, chosen)| chosen);
        Ok(problem.answer(&chosen))
    }
}

impl Method for Frols {
    fn name(&self) -> &'static str {
        "FROLS + BIC"
    }

    fn answer(&self, made: &Made, without: &[Kind]) -> Result<Answer, BenchError> {
        let problem = Problem::of(made, without)?;
        let chosen = forward(&problem.projected, &problem.target);
        Ok(problem.answer(&chosen))
    }
}

struct Problem {
    train: Dictionary,
    holdout: Dictionary,
    /// Columns orthogonal to the nominal model, of unit length.
    projected: Vec<DVector<f64>>,
    /// Residual of the nominal model.
    target: DVector<f64>,
    floor: f64,
}

impl Problem {
    fn of(made: &Made, without: &[Kind]) -> Result<Self, BenchError> {
        let train = Dictionary::of(&made.robot, &made.train, without)?;
        let holdout = Dictionary::of(&made.robot, &made.holdout, without)?;
        let basis = orthonormal(&train.nominal);
        let off = |column: &DVector<f64>| {
            let mut column = column.clone();
            // Twice: one projection leaves rounding errors as large as the subtracted part (Giraud et al. 2005).
            for _ in 0..2 {
                for q in &basis {
                    column.axpy(-q.dot(&column), q, 1.0);
                }
            }
            column
        };
        let target = off(&train.torque);
        let projected = train.terms.iter().map(|term| {
            let mut left = off(&term.column);
            let length = left.norm();
            // A column that the nominal model can represent is no candidate.
            let scale = if length > 1e-6 * term.column.norm() {
                length.recip()
            } else {
                0.0
            };
            left *= scale;
            left
        });
        let projected = projected.collect();
        let floor = match &made.repeat {
            Some(repeat) => {
                let again = Dictionary::torque_of(repeat)?;
                let first = Dictionary::torque_of(&made.train)?;
                let squares = first.iter().zip(&again).map(|(a, b)| (a - b).powi(2));
                (0.5 * squares.sum::<f64>() / first.len().max(1) as f64).sqrt()
            }
            None => 0.0,
        };
        Ok(Self {
            train,
            holdout,
            projected,
            target,
            floor,
        })
    }

    /// Residual RMS on the hold-out after a joint fit of nominal model and chosen terms to the training data.
    fn unseen(&self, chosen: &[usize]) -> f64 {
        let matrix = |of: &Dictionary| {
            let terms = chosen.iter().map(|k| &of.terms[*k].column);
            let columns: Vec<DVector<f64>> = of.nominal.iter().chain(terms).cloned().collect();
            DMatrix::from_columns(&columns)
        };
        let (fitted, seen) = (matrix(&self.train), matrix(&self.holdout));
        let values = Svd::of(fitted).solve(&self.train.torque, 1e-10);
        let left = &self.holdout.torque - seen * values;
        (left.norm_squared() / left.len().max(1) as f64).sqrt()
    }

    fn answer(&self, chosen: &[usize]) -> Answer {
        let mut named: Vec<Named> = Vec::new();
        for term in chosen.iter().map(|k| &self.train.terms[*k]) {
            let name = term.kind.about().name;
            if named.iter().all(|n| n.effect != name) {
                named.push(Named {
                    effect: name.into(),
                    set: vec![name.into()],
                    ..Named::default()
                });
            }
        }
        let (before, after) = (self.unseen(&[]), self.unseen(chosen));
        Answer {
            gap_closed: (!named.is_empty() && before > self.floor)
                .then(|| (before - after) / (before - self.floor)),
            named,
            ..Answer::default()
        }
    }
}

/// Orthonormalises the columns and drops linearly dependent ones.
fn orthonormal(columns: &[DVector<f64>]) -> Vec<DVector<f64>> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in columns {
        let mut left = column.clone();
        for _ in 0..2 {
            for q in &basis {
                left.axpy(-q.dot(&left), q, 1.0);
            }
        }
        let length = left.norm();
        if length > 1e-9 * column.norm() {
            basis.push(left / length);
        }
    }
    basis
}

/// Indices of the remaining terms, largest coefficient first.
fn thresholded(problem: &Problem, threshold: f64) -> Vec<usize> {
    let limit = threshold * problem.target.norm();
    let mut active: Vec<usize> = (0..problem.projected.len())
        .filter(|k| problem.projected[*k].norm_squared() > 0.0)
        .collect();
    for _ in 0..ROUNDS {
        if active.is_empty() {
            return active;
        }
        let columns: Vec<DVector<f64>> = active
            .iter()
            .map(|k| problem.projected[*k].clone())
            .collect();
        let matrix = DMatrix::from_columns(&columns);
        let mut normal = matrix.tr_mul(&matrix);
        // The usual small ridge term of the method; columns have unit length.
        for k in 0..active.len() {
            normal[(k, k)] += 0.05;
        }
        let Some(factor) = normal.cholesky() else {
            return Vec::new();
        };
        let values = factor.solve(&matrix.tr_mul(&problem.target));
        let mut kept: Vec<(f64, usize)> = active
            .iter()
            .zip(values.iter())
            .map(|(k, v)| (v.abs(), *k))
            .filter(|(size, _)| *size >= limit)
            .collect();
        let settled = kept.len() == active.len();
        kept.sort_by(|a, b| b.0.total_cmp(&a.0));
        active = kept.into_iter().map(|(_, k)| k).collect();
        if settled {
            break;
        }
    }
    active
}

/// Indices in the order of their error reduction ratios; BIC decides their number.
fn forward(columns: &[DVector<f64>], target: &DVector<f64>) -> Vec<usize> {
    let n = target.len() as f64;
    let mut left: Vec<DVector<f64>> = columns.to_vec();
    let mut residual = target.clone();
    let bic = |residual: &DVector<f64>, terms: usize| {
        n * (residual.norm_squared() / n).ln() + terms as f64 * n.ln()
    };
    let mut chosen = Vec::new();
    let mut best = (bic(&residual, 0), 0);
    for _ in 0..MOST.min(columns.len()) {
        let gain = |column: &DVector<f64>| {
            let length = column.norm_squared();
            // A column in the span of the chosen ones is only rounding error.
            if length < 1e-8 {
                0.0
            } else {
                column.dot(&residual).powi(2) / length
            }
        };
        let gains = left.iter().enumerate().map(|(k, c)| (gain(c), k));
        let Some((gain, k)) = gains.max_by(|a, b| a.0.total_cmp(&b.0)) else {
            break;
        };
        if gain <= 0.0 {
            break;
        }
        let direction = left[k].normalize();
        chosen.push(k);
        residual.axpy(-direction.dot(&residual), &direction, 1.0);
        for column in &mut left {
            column.axpy(-direction.dot(column), &direction, 1.0);
        }
        let value = bic(&residual, chosen.len());
        if value < best.0 {
            best = (value, chosen.len());
        }
    }
    chosen.truncate(best.1);
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_regression_takes_the_true_columns_in_the_order_of_what_they_explain() {
        let wave = |w: f64| DVector::from_fn(2000, |k, _| (w * k as f64).sin());
        let columns: Vec<DVector<f64>> = [0.011, 0.017, 0.031, 0.047].map(wave).to_vec();
        // A hash as noise: reproducible and nearly uncorrelated with the columns.
        let noise = DVector::from_fn(2000, |k, _| {
            ((k * 7919 % 1009) as f64 / 1009.0 - 0.5) * 0.02
        });
        let target = &columns[2] * 0.5 + &columns[0] * 1.5 + noise;
        assert_eq!(forward(&columns, &target), vec![0, 2]);
    }
}
