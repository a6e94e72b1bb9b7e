//! Described parameters that the data do not improve, or contradict.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::description::parameter_prior::{Direction, is_friction};
use crate::fit::refit::weighed;
use crate::models::description::weights;
use crate::recordings::context::DiagnosisContext;
use crate::rows::regression::Rows;
use rig_identify::contradicted;
use rig_model::robot::DESCRIBED;
use rig_numerics::vector::{axpy, dot};

/// Standard deviation that means "unknown", SI.
const WIDE: f64 = 1e6;
/// Ratio of the posterior to the described variance above which the data add almost nothing.
const HARDLY_BETTER: f64 = 0.5;

/// Described parameters that the data do not improve, or contradict, on robots with several joints.
#[derive(Default)]
pub(crate) struct Open {
    /// Base parameters that the data hardly improve: data and description together know them almost no better than the
    /// description alone.
    pub(crate) held: Vec<usize>,
    /// Described friction that the data contradict, with the difference in standard deviations.
    pub(crate) contradicted: Vec<(usize, f64)>,
}

/// Compares the description with the data. It counts as right to [`DESCRIBED`], and as unknown where it states nothing.
pub(crate) fn open(context: &DiagnosisContext, rows: &Rows) -> Open {
    let anchor = &context.anchor;
    if rows.joints() < 2 || !anchor.stated {
        return Open::default();
    }
    let free = anchor.columns(rows);
    let (fit, memory) = weighed(rows, &free);
    let columns: Vec<Vec<f64>> = free.iter().map(|column| fit.weighted(column)).collect();
    let torque = fit.weighted(&rows.torque.iter().cloned().map(Some).collect());
    let mut spread: Vec<f64> = (described_sizes(context).into_iter())
        .map(|size| DESCRIBED * size)
        .collect();
    for (k, column) in columns.iter().enumerate() {
        let whole = (dot(&torque, &torque) / dot(column, column)).sqrt();
        // Upper limit: this column alone makes the whole torque.
        if anchor.is_unstated(k) && whole.is_finite() {
            spread[k] = whole;
        }
    }
    let rows_in_one = (memory / rows.period).max(1.0);
    let size = columns.len();
    let mut gram = DMatrix::zeros(size, size);
    for a in 0..size {
        for b in 0..=a {
            gram[(a, b)] = dot(&columns[a], &columns[b]) / rows_in_one;
            gram[(b, a)] = gram[(a, b)];
        }
    }
    let mut left = torque;
    for (column, prior) in columns.iter().zip(anchor.prior_coefficients()) {
        axpy(-prior, column, &mut left);
    }
    let along = DVector::from_fn(size, |k, _| dot(&columns[k], &left) / rows_in_one);
    let contradicted = refuted(context, gram.clone(), &along, &spread);
    for (k, _) in &contradicted {
        spread[*k] = f64::INFINITY;
    }
    let known = DMatrix::from_fn(size, size, |a, b| {
        let own = if a == b { 1.0 } else { 0.0 };
        let [a_wide, b_wide] = [a, b].map(|k| spread[k].min(WIDE));
        a_wide * b_wide * gram[(a, b)] + own
    });
    let Some(known) = known.cholesky() else {
        return Open::default();
    };
    let left = known.inverse();
    let alone = |direction: &Direction| match direction.as_slice() {
        [(b, _)] => Some(*b),
        _ => None,
    };
    let held = (anchor.free.iter().enumerate())
        // Unstated parameters are fitted, except friction and constant of a joint that never moves.
        .filter(|(k, _)| !anchor.is_unstated(*k) || dot(&columns[*k], &columns[*k]) <= 0.0)
        .filter(|(k, _)| spread[*k].is_finite() && left[(*k, *k)] > HARDLY_BETTER)
        .filter_map(|(_, direction)| alone(direction))
        .collect();
    let contradicted = (contradicted.into_iter())
        .filter_map(|(k, times)| Some((alone(&anchor.free[k])?, times)))
        .collect();
    Open { held, contradicted }
}

/// Returns the natural size of each free direction, from its described parameters. Each of them counts with at least a
/// share of the largest one of its kind.
pub(crate) fn described_sizes(context: &DiagnosisContext) -> Vec<f64> {
    let combination = &context.nominal.base.combination;
    let sizes = weights(context.robot, combination.ncols());
    (context.anchor.free.iter())
        .map(|direction| {
            let squares = (0..sizes.len()).map(|c| {
                let along: f64 = direction
                    .iter()
                    .map(|&(k, f)| f * combination[(k, c)])
                    .sum();
                (along * sizes[c]).powi(2)
            });
            squares.sum::<f64>().sqrt()
        })
        .collect()
}

/// Returns the directions of described friction that the data contradict. `gram` and `along` are in units of the noise.
fn refuted(
    context: &DiagnosisContext,
    gram: DMatrix<f64>,
    along: &DVector<f64>,
    spread: &[f64],
) -> Vec<(usize, f64)> {
    let (anchor, base) = (&context.anchor, &context.nominal.base);
    let joints = context.robot.joints.len();
    let of_friction = |k: &usize| {
        matches!(anchor.free[*k].as_slice(), [(b, _)] if is_friction(base.columns[*b], joints))
            && !anchor.is_unstated(*k)
    };
    let stated: Vec<usize> = (0..spread.len()).filter(of_friction).collect();
    let SymmetricEigen {
        eigenvalues,
        eigenvectors,
    } = gram.symmetric_eigen();
    let least = eigenvalues.max() * f64::EPSILON;
    let root = eigenvalues.map(|e| if e > least { e.sqrt() } else { 0.0 });
    let data = DMatrix::from_diagonal(&root) * eigenvectors.transpose();
    let turned = eigenvectors.tr_mul(along);
    let right = DVector::from_fn(root.len(), |k, _| {
        if root[k] > 0.0 {
            turned[k] / root[k]
        } else {
            0.0
        }
    });
    contradicted(&data, &right, spread, &stated)
}
