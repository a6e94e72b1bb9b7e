//! The physically consistent full set of standard parameters that belongs to an estimate.

use nalgebra::DVector;
use rig_shared::multibody::COLUMNS;
use serde::Serialize;

use super::prior::Prior;
use super::pseudo_inertia::{INERTIAL, least_eigenvalue};
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;
use crate::uncertainty::relative_error::relative_errors;

/// One standard parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StandardParameter {
    /// Name as in the literature, with the joint's number.
    pub name: String,
    /// Value, SI.
    pub value: f64,
    /// Unit, ASCII.
    pub unit: String,
    /// True if the data determine it alone; if false, they determine a combination and the prior decides the split.
    pub determined: bool,
}

/// A physically consistent set of standard parameters: every link is a possible body, friction and drive inertia ≥ 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StandardSet {
    /// Parameters joint by joint, followed by those of coupled drives.
    pub parameters: Vec<StandardParameter>,
    /// Per joint (one entry for the integral model), increase of the residual RMS over the weighted fit, which is not
    /// constrained to be consistent, %.
    pub residual_increase_percent: Vec<f64>,
    /// Per joint, RMS of the residual over RMS of the torque in the training recordings.
    pub train_relative_error: Vec<f64>,
    /// The same for the hold-out, if given.
    pub holdout_relative_error: Option<Vec<f64>>,
    /// Per link, smallest eigenvalue of the pseudo-inertia scaled to unit mass and unit radius of gyration.
    pub least_eigenvalue: Vec<f64>,
    /// Sentences about the prior that decided what the data do not determine.
    pub prior: Vec<String>,
}

impl StandardSet {
    /// Returns the values in the order of the standard columns.
    pub fn values(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.value).collect()
    }
}

/// The rows by which a consistent set is judged.
pub(crate) struct Judges<'a> {
    /// Training rows by equation.
    pub fitted: &'a [TriangularFactor],
    /// Training rows by joint, torque against motion.
    pub training: &'a [TriangularFactor],
    /// The same for the hold-out.
    pub holdout: Option<&'a [TriangularFactor]>,
    /// RMS torques of both, if the rows do not contain all of the torque.
    pub measured: Option<&'a [Vec<f64>; 2]>,
}

/// Reports a consistent set, compared with the weighted fit.
pub(crate) fn standard_set(
    problem: &Problem,
    prior: &Prior,
    found: &[f64],
    judges: &Judges,
) -> StandardSet {
    let Problem {
        robot, base, data, ..
    } = *problem;
    let full = problem.start_full();
    let consistent_full = (&base.combination * DVector::from_column_slice(found))
        .as_slice()
        .to_vec();
    let combination = &data.combination * &base.combination;
    // A standard column is determined if its unit vector is a combination of identified parameters, that is, if it
    // stands alone in a row of the reduced combinations.
    let alone = |c: usize| {
        (0..combination.nrows()).any(|row| {
            combination
                .row(row)
                .iter()
                .enumerate()
                .all(|(k, v)| (k == c) == (v.abs() > 1e-9))
        })
    };
    let mut remarks = prior.remarks.clone();
    remarks.push(
        "Where the data determine combinations only, the split over the links is the one closest to that prior (log-determinant divergence of the pseudo-inertia).".into(),
    );
    StandardSet {
        parameters: found
            .iter()
            .enumerate()
            .map(|(c, value)| StandardParameter {
                name: base.column_name(c),
                value: *value,
                unit: base.column_unit(c).to_owned(),
                determined: alone(c),
            })
            .collect(),
        train_relative_error: relative_errors(
            judges.training,
            &consistent_full,
            judges.measured.map(|[training, _]| training.as_slice()),
        ),
        holdout_relative_error: judges.holdout.map(|factors| {
            let whole = judges.measured.map(|[_, holdout]| holdout.as_slice());
            relative_errors(factors, &consistent_full, whole)
        }),
        residual_increase_percent: judges
            .fitted
            .iter()
            .map(|factor| {
                let free = factor.residual_squares(&full).sqrt();
                let bound = factor.residual_squares(&consistent_full).sqrt();
                100.0 * (bound / free.max(f64::MIN_POSITIVE) - 1.0)
            })
            .collect(),
        least_eigenvalue: (0..robot.link_count())
            .map(|i| least_eigenvalue(&found[i * COLUMNS..i * COLUMNS + INERTIAL]))
            .collect(),
        prior: remarks,
    }
}
