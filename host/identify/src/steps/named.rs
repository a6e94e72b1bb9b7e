//! The identified base parameters with their names.

use nalgebra::DMatrix;
use rig_shared::multibody::{COLUMNS, column};

use crate::estimator::Estimator;
use crate::estimators::problem::Problem;
use crate::identification::BaseParameter;
use crate::structure::columns::expression;
use crate::uncertainty::estimate::Estimate;

/// The identified combinations of standard parameters.
pub(crate) struct Named {
    /// Identified values = combination·π; one row per parameter.
    pub combination: DMatrix<f64>,
    /// Standard column that represents each parameter.
    pub columns: Vec<usize>,
    /// Values with intervals and units.
    pub parameters: Vec<BaseParameter>,
}

impl Named {
    /// Names the parameters of an estimate.
    pub(crate) fn of(problem: &Problem, estimate: &Estimate) -> Self {
        let base = problem.base;
        let combination = &problem.data.combination * &base.combination;
        let columns: Vec<usize> = (problem.data.kept.iter())
            .map(|&k| base.columns[k])
            .collect();
        let parameters = (0..columns.len())
            .map(|k| BaseParameter {
                expression: expression(&combination, k, columns[k]),
                value: estimate.values[k],
                std: estimate.std[k],
                relative_std_percent: 100.0 * estimate.std[k] / estimate.values[k].abs(),
                unit: base.column_unit(columns[k]).to_owned(),
                interval: if problem.options.estimator == Estimator::Consistent
                    && not_below_zero(&combination, k, columns[k])
                {
                    estimate.interval[k].map(|end| end.max(0.0))
                } else {
                    estimate.interval[k]
                },
                classical_relative_std_percent: 100.0 * estimate.classical_std[k]
                    / estimate.values[k].abs(),
            })
            .collect();
        Self {
            combination,
            columns,
            parameters,
        }
    }
}

/// Returns true if an identified combination is only friction or only drive inertia, which cannot be negative.
fn not_below_zero(combination: &DMatrix<f64>, row: usize, column: usize) -> bool {
    let alone = combination
        .row(row)
        .iter()
        .filter(|x| x.abs() > 1e-9)
        .count()
        == 1;
    alone
        && matches!(
            column % COLUMNS,
            column::DRIVE_INERTIA | column::VISCOUS | column::COULOMB
        )
}
