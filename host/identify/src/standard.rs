//! The physically consistent full set of standard parameters that belongs to an estimate.

use nalgebra::DVector;
use rig_shared::multibody::COLUMNS;
use serde::Serialize;

use super::IdentifyError;
use super::base::Base;
use super::bodies::Sizes;
use super::compare::relative_errors;
use super::consistent::{Consistent, Quadratic, consistent};
use super::factor::TriangularFactor;
use super::least::triangle;
use super::parts::{LeaveOut, Parts};
use super::prior::{Hints, Prior};
use super::problem::{Fitted, Problem};
use super::pseudo_inertia::{INERTIAL, least_eigenvalue};
use rig_data::prepare::Survey;
use rig_model::robot::{DESCRIBED, Robot};
use rig_output::format_significant;

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

/// Share of the fastest joint's speed below which a joint hardly moves (rad/s and m/s compared directly).
const HARDLY: f64 = 1e-4;

/// Builds the prior of `robot`, with hints from a fit of all base columns.
pub(super) fn prior_of(
    robot: &Robot,
    base: &Base,
    surveys: &[Survey],
    full: &[f64],
    uncertainty: Option<f64>,
) -> Prior {
    let joints = robot.joints.len();
    let over = |of: &dyn Fn(&Survey, usize) -> f64| {
        (0..joints)
            .map(|j| surveys.iter().map(|s| of(s, j)).fold(0.0, f64::max))
            .collect::<Vec<f64>>()
    };
    let speed = over(&|s, j| s.joints[j].spectrum.velocity_rms());
    // Only the order of magnitude is needed: a motion of that speed at its highest frequency.
    let acceleration = over(&|s, j| {
        let spectrum = &s.joints[j].spectrum;
        std::f64::consts::TAU * spectrum.motion * spectrum.velocity_rms()
    });
    let sizes = Sizes {
        torque: over(&|s, j| s.joints[j].torque_rms),
        acceleration,
        speed,
    };
    let columns = base.combination.ncols();
    Prior::of(
        robot,
        columns,
        &hints(columns, (&base.columns, full), sizes),
        uncertainty.unwrap_or(DESCRIBED),
    )
}

/// Collects hints for the `columns` standard columns: base columns with fitted values, and the joints' motion.
pub(super) fn hints(columns: usize, (base, full): (&[usize], &[f64]), sizes: Sizes) -> Hints {
    let mut values = vec![f64::NAN; columns];
    for (&c, &value) in base.iter().zip(full) {
        if value != 0.0 {
            values[c] = value;
        }
    }
    // A joint that hardly moves gives no scale; it is assumed to move like the others.
    let like_others = |list: Vec<f64>| -> Vec<f64> {
        let most = list.iter().copied().fold(0.0, f64::max);
        list.into_iter()
            .map(|own| if own < HARDLY * most { most } else { own })
            .collect()
    };
    Hints {
        torque: sizes.torque,
        acceleration: like_others(sizes.acceleration),
        values,
        speed: like_others(sizes.speed),
    }
}

/// Builds the problem from a factor whose rows are in units of the residual's noise.
pub(super) fn quadratic(factor: &TriangularFactor, base: &Base) -> Quadratic {
    let (r, right) = factor.system();
    Quadratic {
        matrix: r * &base.combination,
        right,
    }
}

/// The same for a given estimate of all base columns instead of the data's own optimum.
pub(super) fn quadratic_about(factor: &TriangularFactor, base: &Base, full: &[f64]) -> Quadratic {
    let (r, _) = factor.system();
    let right = &r * DVector::from_column_slice(full);
    Quadratic {
        matrix: r * &base.combination,
        right,
    }
}

/// The rows by which a consistent set is judged.
pub(super) struct Judges<'a> {
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
pub(super) fn standard_set(
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
        least_eigenvalue: (0..robot.joints.len())
            .map(|i| least_eigenvalue(&found[i * COLUMNS..i * COLUMNS + INERTIAL]))
            .collect(),
        prior: remarks,
    }
}

/// Fits under the constraint of physical consistency.
pub(super) fn consistent_fit(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
) -> Result<Fitted, IdentifyError> {
    let all = LeaveOut::of(&parts.weighted(&problem.tempered(parts)));
    let fit = |factor: &TriangularFactor| -> Result<Consistent, IdentifyError> {
        consistent(&quadratic(factor, problem.base), prior)
    };
    let whole = fit(&all.whole)?;
    let standard = all.refit(&|factor| Ok(fit(factor)?.parameters))?;
    let full = standard.map(&|pi| {
        (&problem.base.combination * DVector::from_column_slice(pi))
            .as_slice()
            .to_vec()
    });
    let kept = full.map(&|values| problem.identified(values));
    let regressor = triangle(&all.whole, problem.data);
    let along = prior.own(&problem.base.combination) * whole.spread;
    let covariance = &along * along.transpose();
    let identified = problem.identified_covariance(&covariance);
    Ok(Fitted {
        classical_std: (0..kept.whole.len())
            .map(|k| identified[(k, k)].max(0.0).sqrt())
            .collect(),
        standard: Some(whole.parameters),
        full,
        kept,
        covariance: Some(covariance),
        regressor,
        said: vec![format!(
            "Convex problem solved in {} Newton steps. Intervals are those of the posterior: the description's inertial values count as right to {} times their size.",
            whole.steps,
            format_significant(problem.options.prior_uncertainty.unwrap_or(DESCRIBED), 2)
        )],
        warnings: Vec::new(),
        doubtful: None,
    })
}
