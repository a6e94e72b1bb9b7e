//! Essential parameters: the few that suffice for the torque, with the others taken as zero.
//!
//! Backward elimination by relative standard deviation (Pham & Gautier 1991; Khalil & Dombre 2002, § 12.4.4). The least
//! certain parameter is removed and the others are refitted. This ends when no parameter is more than [`RATIO`] times
//! as uncertain as the best one, or when an F-test finds a removed one significant. The F-test counts independent rows.
//! It tests the last parameter alone and all removed ones together, because many insignificant ones would hide a
//! significant one.
//!
//! It starts from the returned estimate and its covariance. Starting from a free fit could give values that no body has
//! if the estimate is physically consistent.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;
use serde::Serialize;

use crate::rows::factor::TriangularFactor;
use crate::uncertainty::estimate::f_p_value;

/// Ratio of the largest to the smallest relative standard deviation at which elimination ends; the literature uses 10
/// to 30.
const RATIO: f64 = 30.0;
/// p-value of the F-test below which the removed parameters are significant.
const NEEDED: f64 = 0.05;

/// One essential parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Essential {
    /// Expression as in `base_parameters`.
    pub expression: String,
    /// Value, SI, fitted with the inessential ones at zero.
    pub value: f64,
    /// Relative standard deviation, %; allows for correlated residuals.
    pub relative_std_percent: f64,
    /// Unit, ASCII.
    pub unit: String,
}

/// The essential set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EssentialSet {
    /// Parameters in the order of `base_parameters`.
    pub parameters: Vec<Essential>,
    /// Expressions of the removed parameters, in the order of elimination.
    pub left_out: Vec<String>,
    /// Increase of the residual RMS, %.
    pub residual_increase_percent: f64,
    /// Reason why elimination ended, a sentence.
    pub ended: String,
}

struct Fit {
    values: Vec<f64>,
    relative: Vec<f64>,
    squares: f64,
}

/// Information about the identified combinations x, as ‖r·x − z‖² + rest.
pub(crate) struct Known {
    r: DMatrix<f64>,
    z: DVector<f64>,
    /// Squares that no x explains.
    rest: f64,
    /// Number of rows.
    rows: f64,
    /// Correlation time of the residual in rows.
    memory: f64,
    /// True if the squares are in units of the noise variance; otherwise the residual gives the variance.
    unit: bool,
}

impl Known {
    /// Builds it from least squares on weighted rows. `columns` are the identified ones in the factor, `memory` is the
    /// correlation time of the residual in rows. `None` if the fit is singular.
    pub(crate) fn of_rows(
        factor: &TriangularFactor,
        columns: &[usize],
        memory: f64,
    ) -> Option<Self> {
        let (r, z) = factor.system();
        let solution = Svd::of(r.clone()).solve(&z, 1e-12 * r.norm());
        let rest =
            factor.residual_squares(solution.as_slice()) - (&r * &solution - &z).norm_squared();
        Some(Self {
            r: r.select_columns(columns),
            z,
            rest: rest.max(0.0),
            rows: factor.rows() as f64,
            memory,
            unit: false,
        })
    }

    /// Builds it from an estimate with its covariance. `None` if the covariance has no inverse.
    pub(crate) fn of_estimate(
        values: &[f64],
        covariance: &DMatrix<f64>,
        rows: f64,
    ) -> Option<Self> {
        // Scaled to correlations: columns differ by many orders of magnitude.
        let std = covariance.diagonal().map(f64::sqrt);
        let size = values.len();
        let correlation =
            DMatrix::from_fn(size, size, |i, j| covariance[(i, j)] / (std[i] * std[j]));
        let inverse = correlation.cholesky()?.inverse().cholesky()?;
        let upper = inverse.l().transpose();
        let r = DMatrix::from_fn(size, size, |i, j| upper[(i, j)] / std[j]);
        let z = &r * DVector::from_column_slice(values);
        Some(Self {
            r,
            z,
            rest: 0.0,
            rows,
            memory: 1.0,
            unit: true,
        })
    }

    /// Builds it from an estimate; the rows of `factor` give the information about each combination.
    pub(crate) fn about(
        values: &[f64],
        factor: &TriangularFactor,
        columns: &[usize],
        memory: f64,
    ) -> Option<Self> {
        let mut known = Self::of_rows(factor, columns, memory)?;
        let least = known.fit(&(0..columns.len()).collect::<Vec<_>>())?.squares;
        known.z = &known.r * DVector::from_column_slice(values);
        known.rest = least;
        Some(known)
    }

    fn variance(&self, squares: f64, active: usize) -> f64 {
        if self.unit {
            1.0
        } else {
            squares / (self.rows - active as f64).max(1.0) * self.memory
        }
    }

    fn fit(&self, active: &[usize]) -> Option<Fit> {
        let a = self.r.select_columns(active);
        let qr = a.clone().qr();
        let inverse = qr.r().try_inverse()?;
        let values = &inverse * (qr.q().transpose() * &self.z);
        let squares = (&a * &values - &self.z).norm_squared() + self.rest;
        let variance = self.variance(squares, active.len());
        let relative = (0..active.len())
            .map(|k| variance.sqrt() * inverse.row(k).norm() / values[k].abs())
            .collect();
        Some(Fit {
            values: values.as_slice().to_vec(),
            relative,
            squares,
        })
    }
}

/// Runs the elimination; `left` returns the torque residual for values of all identified combinations. `None` if the
/// fit is singular.
pub(crate) fn essential(
    known: &Known,
    names: &[(String, String)],
    left: &dyn Fn(&[f64]) -> f64,
) -> Option<EssentialSet> {
    let size = known.r.ncols();
    let rows = known.rows / known.memory;
    let fit = |active: &[usize]| known.fit(active);
    let mut active: Vec<usize> = (0..size).collect();
    let first = fit(&active)?;
    let freedom = (rows - size as f64).max(1.0);
    let mut current = Fit {
        values: first.values.clone(),
        relative: first.relative.clone(),
        squares: first.squares,
    };
    let mut left_out = Vec::new();
    let ended = loop {
        let worst = (0..active.len())
            .max_by(|&a, &b| current.relative[a].total_cmp(&current.relative[b]))?;
        let least = current
            .relative
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        if current.relative[worst] <= RATIO * least {
            break format!(
                "None is more than {RATIO} times as uncertain, relative to its value, as the best known one."
            );
        }
        if active.len() == 1 {
            break "One parameter is left.".to_owned();
        }
        let mut fewer = active.clone();
        let gone = fewer.remove(worst);
        let next = fit(&fewer)?;
        // With a correlation time of m rows, chance changes the squares by m times as much.
        let variance = known.variance(first.squares, size);
        let chance = |grown: f64, removed: f64| {
            let f = grown / removed / variance.max(f64::MIN_POSITIVE);
            f_p_value(f, [removed, freedom]).unwrap_or(1.0)
        };
        let removed = (size - fewer.len()) as f64;
        let p = chance(next.squares - current.squares, 1.0)
            .min(chance(next.squares - first.squares, removed));
        if p < NEEDED {
            break format!(
                "Without {} the residual would grow by more than chance (F-test, p = {p:.1e}).",
                names[gone].0
            );
        }
        left_out.push(names[gone].0.clone());
        (active, current) = (fewer, next);
    };
    let mut few = vec![0.0; size];
    for (&k, value) in active.iter().zip(&current.values) {
        few[k] = *value;
    }
    let grown = left(&few) / left(&first.values).max(f64::MIN_POSITIVE);
    Some(EssentialSet {
        parameters: active
            .iter()
            .enumerate()
            .map(|(place, &k)| Essential {
                expression: names[k].0.clone(),
                value: current.values[place],
                relative_std_percent: 100.0 * current.relative[place],
                unit: names[k].1.clone(),
            })
            .collect(),
        left_out,
        residual_increase_percent: 100.0 * (grown - 1.0),
        ended,
    })
}
