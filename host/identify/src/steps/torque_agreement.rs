//! Torques of joints against each other: a factor in one joint's torques alone.
//!
//! The equations of several joints share parameters: inertias and first moments of the outer links act on the inner joints.
//! A factor in the torques of one joint makes their equations contradict each other, whatever the parameters are. No
//! described mass is needed, and no gravity. Three fits are compared (χ² of what is left beyond each joint's own fit, in
//! units of its noise): common parameters; common parameters and one factor at one joint; own parameters for each joint. If
//! the first one is contradicted and the second one is not, the factor explains all of the contradiction.
//!
//! Of two joints either one may be off. Of more joints, all others off by the inverse factor look alike.
//!
//! Leaves out: factors of several joints; other errors beside the factor, such as friction that the model lacks: then
//! nothing is said.

use nalgebra::{DMatrix, DVector};

use super::own_fit::{OwnFit, ROUNDING, directions, is_contradicted};
use crate::warning::{TorqueFactor, Warning};
use rig_model::robot::{CONTRADICTED, Robot};
use rig_numerics::svd::Svd;

/// What a joint's torque shows, one row per independent direction of its own parameters, in units of its noise.
struct Shown {
    regressor: DMatrix<f64>,
    torque: DVector<f64>,
}

impl Shown {
    fn of(fit: &OwnFit) -> Self {
        let (r, z) = &fit.system;
        let shown = directions(r.clone());
        Self {
            regressor: shown.tr_mul(r) / fit.std,
            torque: shown.tr_mul(z) / fit.std,
        }
    }
}

/// A fit of all joints with common parameters.
struct CommonFit {
    /// True if it leaves more beyond the joints' own fits than noise does.
    is_contradicted: bool,
    /// Coefficient of the last column, which is the scaled torque if there is one, and its standard deviation.
    last: [f64; 2],
}

impl CommonFit {
    /// Fits the joints; the torque of `scaled` has a free factor. `None` if as many parameters as rows are free.
    fn of(joints: &[Shown], scaled: Option<usize>) -> Option<Self> {
        let rows: usize = joints.iter().map(|own| own.torque.len()).sum();
        let p = joints.first()?.regressor.ncols();
        let width = p + usize::from(scaled.is_some());
        let mut x = DMatrix::zeros(rows, width);
        let mut y = DVector::zeros(rows);
        let mut at = 0;
        for (j, own) in joints.iter().enumerate() {
            let n = own.torque.len();
            x.view_mut((at, 0), (n, p)).copy_from(&own.regressor);
            y.rows_mut(at, n).copy_from(&own.torque);
            if scaled == Some(j) {
                // (1 + u)·y = x·β
                x.view_mut((at, p), (n, 1)).copy_from(&-&own.torque);
            }
            at += n;
        }
        let sizes: Vec<f64> = x.column_iter().map(|c| c.norm()).collect();
        for (mut column, size) in x.column_iter_mut().zip(&sizes) {
            if *size > 0.0 {
                column /= *size;
            }
        }
        let svd = Svd::of(x.clone());
        let least = ROUNDING.sqrt() * svd.singular_values.max();
        let rank = (svd.singular_values.iter().filter(|s| **s > least)).count();
        let freedom = rows.checked_sub(rank).filter(|n| *n > 0)?;
        let values = svd.solve(&y, least);
        let squares = (y - x * &values).norm_squared();
        let inverse = svd.pseudo_inverse(least);
        let last = width - 1;
        Some(Self {
            is_contradicted: is_contradicted(squares, freedom),
            last: [values[last], inverse.row(last).norm()].map(|v| v / sizes[last]),
        })
    }
}

/// Says which joint's torque is that of the others times a factor. Friction that changes with load or position must not
/// explain the contradiction as well.
pub(crate) fn torque_agreement(
    fits: &[OwnFit],
    varying: Option<&[OwnFit]>,
    robot: &Robot,
) -> Option<Warning> {
    let mut found = factors(fits, robot)?;
    if let Some(varying) = varying.filter(|_| !found.is_empty()) {
        let beside = factors(varying, robot).unwrap_or_default();
        found.retain(|own| beside.iter().any(|other| own.is_like(other)));
    }
    (!found.is_empty()).then_some(Warning::TorqueDisagrees(found))
}

/// Returns the joints of which one factor explains the contradiction; `None` if there is none.
fn factors(fits: &[OwnFit], robot: &Robot) -> Option<Vec<TorqueFactor>> {
    if fits.len() < 2 || fits.iter().any(|fit| fit.rows == 0) {
        return None;
    }
    let joints: Vec<Shown> = fits.iter().map(Shown::of).collect();
    if !CommonFit::of(&joints, None)?.is_contradicted {
        return None;
    }
    let found: Vec<TorqueFactor> = (0..joints.len())
        .filter_map(|j| {
            let fit = CommonFit::of(&joints, Some(j)).filter(|fit| !fit.is_contradicted)?;
            let [u, std] = fit.last;
            let factor = 1.0 / (1.0 + u);
            Some(TorqueFactor {
                joint: robot.joints[j].name.clone(),
                factor,
                std: std * factor * factor,
            })
        })
        .filter(|own| (own.factor - 1.0).abs() > CONTRADICTED * own.std)
        .collect();
    Some(found)
}
