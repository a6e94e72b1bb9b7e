//! Total least squares: noise in the regressor as well as in the torque (Golub & Van Loan 1980; generalised to
//! correlated columns of unequal noise, Van Huffel & Vandewalle 1991).
//!
//! The noise of the columns is measured: white noise of the level in the position's spectrum is added to the recording
//! once more. Its effect on the rows, through all filters and differences, is collected as a triangular factor G. Let R
//! be the factor of [X | y], and add the torque's noise variance to G. The estimate is the direction v = [β; −1] that
//! maximises ‖G·v‖/‖R·v‖: the largest singular value of G·R⁻¹. So no covariance is formed or inverted, and columns
//! without noise (offsets) need no special case. The torque's noise is the residual variance beyond that of the
//! columns, found by iteration.
//!
//! Limits: no torque noise that the position noise causes through the controller (use instrumental variables); no
//! position noise that is not white below the cut-off; no second-order errors in the noise.

use rig_numerics::svd::Svd;
use std::cell::RefCell;

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::fitted::Fitted;
use super::linear::{classical, spread, triangle};
use super::problem::Problem;
use super::twin::{Companion, Twin, each_pair};
use crate::error::{IdentifyError, singular};
use crate::rows::factor::TriangularFactor;
use crate::uncertainty::jackknife::{LeaveOut, Refit};
use crate::uncertainty::parts::Parts;
use rig_data::Block;
use rig_data::prepare::PrepareError;

/// Number of iterations of the torque's noise level, which converges geometrically.
const PASSES: usize = 50;
/// Smallest share of the residual's variance attributed to the torque. If the columns' noise would explain more, its
/// level was overestimated.
const LEAST_TORQUE_SHARE: f64 = 0.01;

/// Companion that adds the same amount of noise to the measured position once more.
struct Disturbed {
    sigma: Vec<f64>,
    generator: rand_pcg::Pcg64,
}

impl Companion for Disturbed {
    fn positions(&mut self, block: &Block) -> Result<Vec<Vec<f64>>, PrepareError> {
        Ok(block
            .joints
            .iter()
            .zip(&self.sigma)
            .map(|(joint, sigma)| {
                joint
                    .q
                    .iter()
                    .map(|q| {
                        let normal: f64 = StandardNormal.sample(&mut self.generator);
                        q + sigma * normal
                    })
                    .collect()
            })
            .collect())
    }
}

/// Returns the standard deviation of each joint's position noise, from its spectrum, rad or m.
fn noise_levels(problem: &Problem) -> Vec<f64> {
    let treatment = problem.plan.treatment;
    // A one-sided density of d over half the rate is a variance of d·rate/2.
    let spectra = treatment.spectra.iter();
    spectra
        .map(|s| (0.5 * s.floor * treatment.sample_rate).max(0.0).sqrt())
        .collect()
}

/// Returns the expected bias of weighted least squares at `values` from that noise: (XᵀX)⁻¹·N·β with N the noise of the
/// columns (Fuller 1987, sec. 1.1).
pub(crate) fn moved_by_noise(
    problem: &Problem,
    parts: &Parts,
    values: &[f64],
) -> Result<Vec<f64>, IdentifyError> {
    let noise = column_noise(problem, &noise_levels(problem))?;
    let whole = LeaveOut::of(&parts.weighted(problem.weights)).whole;
    let beta = DVector::from_column_slice(values);
    let size = values.len();
    let mut pull = DVector::zeros(size);
    for (factor, weight) in noise.iter().zip(problem.weights) {
        let width = factor.columns() + 1;
        let own = DMatrix::from_vec(width, width, factor.triangle())
            .view((0, 0), (size, size))
            .into_owned();
        pull += own.tr_mul(&(&own * &beta)) * weight.powi(2);
    }
    let r = triangle(&whole, problem.data);
    r.tr_solve_upper_triangular(&pull)
        .and_then(|half| r.solve_upper_triangular(&half))
        .map(|moved| moved.as_slice().to_vec())
        .ok_or_else(|| singular("of the regressor"))
}

/// Returns the columns' noise per equation: factor of the differences, with the number of rows.
fn column_noise(problem: &Problem, sigma: &[f64]) -> Result<Vec<TriangularFactor>, IdentifyError> {
    let kept = &problem.data.kept;
    let p = problem.base.len();
    let factors = RefCell::new(vec![
        TriangularFactor::new(kept.len());
        problem.weights.len()
    ]);
    let make = |r: usize| {
        Ok(Box::new(Disturbed {
            sigma: sigma.to_vec(),
            generator: rand_pcg::Pcg64::seed_from_u64(problem.options.seed.wrapping_add(r as u64)),
        }) as Box<dyn Companion>)
    };
    let weights: Vec<f64> = problem.recording_weights().collect();
    let mut row = vec![0.0; kept.len()];
    each_pair(
        problem,
        &Twin::Made(&make),
        &mut |r, measured, disturbed| {
            let mut factors = factors.borrow_mut();
            for (k, (own, other)) in measured
                .equations
                .iter()
                .zip(&disturbed.equations)
                .enumerate()
            {
                for i in (0..own.y.len()).filter(|&i| own.keep[i]) {
                    for (to, &c) in row.iter_mut().zip(kept) {
                        *to = other.x[i * p + c] - own.x[i * p + c];
                    }
                    factors[k].push(&row, 0.0, weights[r]);
                }
            }
        },
    )?;
    Ok(factors.into_inner())
}

/// Data of one fit: factors per equation.
struct Rows<'a> {
    weighted: &'a TriangularFactor,
    equations: Vec<TriangularFactor>,
}

struct Solved {
    values: Vec<f64>,
    torque: Vec<f64>,
}

/// Solves with the noise factors scaled to these rows.
fn solve(
    problem: &Problem,
    rows: &Rows,
    noise: &[TriangularFactor],
) -> Result<Solved, IdentifyError> {
    let kept = &problem.data.kept;
    let size = kept.len();
    let triangle = |factor: &TriangularFactor, pick: &[usize]| {
        let width = factor.columns() + 1;
        let all = DMatrix::from_vec(width, width, factor.triangle());
        all.select_columns(pick)
    };
    let mut with_right: Vec<usize> = kept.clone();
    with_right.push(problem.base.len());
    let data = triangle(rows.weighted, &with_right).qr().r();
    let inverse = data
        .try_inverse()
        .ok_or_else(|| singular("of [regressor | torque]"))?;
    let every: Vec<usize> = (0..=size).collect();
    let columns: Vec<DMatrix<f64>> = noise.iter().map(|f| triangle(f, &every)).collect();
    let share: Vec<f64> = noise
        .iter()
        .zip(&rows.equations)
        .map(|(f, own)| own.rows() as f64 / f.rows().max(1) as f64)
        .collect();
    let mut torque = vec![1.0; noise.len()];
    let mut values = vec![0.0; size];
    for pass in 0..PASSES {
        let mut stacked = DMatrix::zeros((size + 1) * noise.len() + 1, size + 1);
        let mut right = 0.0;
        for (k, own) in columns.iter().enumerate() {
            let scale = problem.weights[k] * share[k].sqrt();
            stacked
                .rows_mut(k * (size + 1), size + 1)
                .copy_from(&(own * scale));
            right += torque[k] * problem.weights[k].powi(2) * rows.equations[k].rows() as f64;
        }
        let last = stacked.nrows() - 1;
        stacked[(last, size)] = right.sqrt();
        let svd = Svd::of(stacked * &inverse);
        let v = &inverse * svd.v_t.row(0).transpose();
        let next: Vec<f64> = (0..size).map(|k| -v[k] / v[size]).collect();
        if !next.iter().all(|x| x.is_finite()) {
            return Err(singular("of [regressor | torque]"));
        }
        let full = spread(&next, kept, problem.base.len());
        let mut direction = DVector::from_column_slice(&next);
        direction = direction.push(0.0);
        let mut change = 0.0f64;
        for (k, own) in columns.iter().enumerate() {
            let count = rows.equations[k].rows().max(1) as f64;
            let residual = rows.equations[k].residual_squares(&full) / count;
            let carried = share[k] * (own * &direction).norm_squared() / count;
            let level = (residual - carried).max(LEAST_TORQUE_SHARE * residual);
            change = change.max((level / torque[k] - 1.0).abs());
            torque[k] = level;
        }
        values = next;
        if pass > 0 && change < 1e-9 {
            break;
        }
    }
    Ok(Solved { values, torque })
}

/// Fits by total least squares.
pub(crate) fn total(problem: &Problem, parts: &Parts) -> Result<Fitted, IdentifyError> {
    let sigma = noise_levels(problem);
    let noise = column_noise(problem, &sigma)?;
    let all = LeaveOut::of(&parts.weighted(problem.weights));
    let equations = |left_out: Option<usize>| -> Vec<TriangularFactor> {
        (0..noise.len())
            .map(|k| {
                let mut whole = TriangularFactor::new(problem.base.len());
                for (g, part) in parts.fitted.iter().enumerate() {
                    if left_out != Some(g) {
                        whole.merge(&part[k], 1.0);
                    }
                }
                whole
            })
            .collect()
    };
    let fit = |weighted: &TriangularFactor, left_out| {
        solve(
            problem,
            &Rows {
                weighted,
                equations: equations(left_out),
            },
            &noise,
        )
    };
    let whole = fit(&all.whole, None)?;
    let kept = Refit {
        without: all
            .without
            .iter()
            .enumerate()
            .map(|(g, factor)| Ok(fit(factor, Some(g))?.values))
            .collect::<Result<_, IdentifyError>>()?,
        whole: whole.values,
    };
    let data = problem.data;
    let (classical_std, _) = classical(&all.whole, data, &kept.whole)?;
    let levels: Vec<String> = sigma
        .iter()
        .zip(&problem.robot.joints)
        .map(|(s, joint)| format!("{} {s:.3e}", joint.name))
        .collect();
    let torques: Vec<String> = whole
        .torque
        .iter()
        .map(|t| format!("{:.4}", t.sqrt()))
        .collect();
    Ok(Fitted {
        full: kept.map(&|values| spread(values, &data.kept, problem.base.len())),
        kept,
        standard: None,
        classical_std,
        covariance: None,
        regressor: triangle_of(&all.whole, problem),
        said: vec![format!(
            "Noise of the position, from its spectrum: {} (rad or m). Noise left to the torque, equation by equation: {}.",
            levels.join(", "),
            torques.join(", ")
        )],
        warnings: Vec::new(),
        doubtful: None,
    })
}

fn triangle_of(factor: &TriangularFactor, problem: &Problem) -> DMatrix<f64> {
    triangle(factor, problem.data)
}
