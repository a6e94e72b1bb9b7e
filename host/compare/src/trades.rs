//! Pairs of parameters that take over torque from each other.

use nalgebra::{DMatrix, DVector};

use crate::basis::Basis;
use crate::common::Common;
use crate::identified_set::IdentifiedSet;
use crate::matrices::quadratic;
use crate::result::Trade;

/// Correlation of the errors within a set from which a pair is looked at.
pub const CORRELATED: f64 = 0.8;
/// Largest RMS torque of both differences together, as a share of the smaller of the two alone, of a pair that trades.
/// 0.71: at least half of the mean squared torque cancels.
pub const TOGETHER: f64 = 0.71;

/// Returns the pairs that trade, by falling torque of a single difference.
pub(crate) fn trades(sets: &[IdentifiedSet], basis: &Basis, common: &Common) -> Vec<Trade> {
    let Some(covariance) = common.covariance() else {
        return Vec::new();
    };
    let metric = torque_metric(sets, basis).select_rows(&common.parameters);
    let metric = metric.select_columns(&common.parameters);
    let c = common.parameters.len();
    let mut found = Vec::new();
    for k in 0..c {
        for l in k + 1..c {
            let rho = covariance[(k, l)] / (covariance[(k, k)] * covariance[(l, l)]).sqrt();
            if rho.abs() >= CORRELATED
                && let Some(trade) = farthest(sets, basis, common, &metric, [k, l], rho)
            {
                found.push(trade);
            }
        }
    }
    found.sort_by(|a: &Trade, b| b.torque[0].total_cmp(&a.torque[0]));
    found
}

/// Returns the trade of a pair between the two sets that differ most, if it is one.
fn farthest(
    sets: &[IdentifiedSet],
    basis: &Basis,
    common: &Common,
    metric: &DMatrix<f64>,
    [k, l]: [usize; 2],
    correlation: f64,
) -> Option<Trade> {
    let pair = metric.select_rows(&[k, l]).select_columns(&[k, l]);
    let mut most: Option<Trade> = None;
    for a in 0..sets.len() {
        for b in a + 1..sets.len() {
            let d = &common.values[b] - &common.values[a];
            let both = DVector::from_vec(vec![d[k], d[l]]);
            let torque = [
                d[k].abs() * pair[(0, 0)].sqrt(),
                d[l].abs() * pair[(1, 1)].sqrt(),
                quadratic(&pair, &both).max(0.0).sqrt(),
            ];
            if most.as_ref().is_none_or(|m| torque[0] > m.torque[0]) {
                most = Some(Trade {
                    pair: [k, l].map(|x| basis.names[common.parameters[x]].clone()),
                    correlation,
                    sets: [a, b].map(|s| sets[s].name.clone()),
                    differences: [d[k], d[l]],
                    torque,
                });
            }
        }
    }
    most.filter(|t| t.torque[2] <= TOGETHER * t.torque[0].min(t.torque[1]))
}

/// Returns G with φᵀ·G·φ the mean squared torque of parameters φ, each joint in units of its residual.
fn torque_metric(sets: &[IdentifiedSet], basis: &Basis) -> DMatrix<f64> {
    let p = basis.to_base.nrows();
    let (mut sum, mut rows) = (DMatrix::zeros(p, p), 0.0);
    for set in sets {
        sum += set.information();
        rows += set
            .rows
            .factors
            .iter()
            .map(|f| f.rows() as f64)
            .sum::<f64>();
    }
    basis.to_base.transpose() * sum * &basis.to_base / rows.max(1.0)
}
