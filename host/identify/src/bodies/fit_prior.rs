//! The prior of the parameters of an identification.

use super::hints::{Sizes, hints};
use super::prior::Prior;
use super::quadratic::quadratic;
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;
use crate::structure::base::Base;
use rig_data::prepare::Survey;
use rig_model::robot::{DESCRIBED, Robot};

/// Builds the prior of `robot`, with hints from a fit of all base columns.
pub(crate) fn prior_of(
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

pub(crate) fn prior(problem: &Problem) -> Prior {
    prior_of(
        problem.robot,
        problem.base,
        problem.surveys,
        &problem.start_full(),
        problem.options.prior_uncertainty,
    )
}

/// Returns the prior without values that the data contradict; `factor` has the unit σ·√(correlation time).
pub(crate) fn prior_beside(problem: &Problem, factor: &TriangularFactor) -> Prior {
    // A prior uncertainty set by the user is used for all values.
    if problem.options.prior_uncertainty.is_some() {
        return prior(problem);
    }
    let data = quadratic(factor, problem.base);
    prior(problem).without_contradicted(&data.matrix, &data.right, problem.robot)
}
