//! Inertias and viscous friction that came out below zero.

use rig_shared::multibody::{COLUMNS, column};

use crate::identification::{BaseParameter, Identification};
use crate::uncertainty::residual::LEAST_ERROR;
use crate::warning::Warning;
use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit};

/// Coefficients of a base parameter below this are rounding errors.
const ROUNDING: f64 = 1e-9;

/// Standard parameters that no body and no drive has below zero.
const POSITIVE: [usize; 7] = [
    column::MASS,
    // Ixx, Iyy, Izz of Ixx Ixy Ixz Iyy Iyz Izz.
    column::INERTIA,
    column::INERTIA + 3,
    column::INERTIA + 5,
    column::DRIVE_INERTIA,
    column::VISCOUS,
    column::COULOMB,
];

impl Identification {
    /// Returns true if a base parameter is a sum of masses, moments of inertia and friction with positive factors, which
    /// cannot be negative.
    pub fn is_positive_sum(&self, parameter: usize) -> bool {
        let own = self.details.combination.row(parameter);
        // Columns of motors that move several joints come after those of the links.
        let links = self.details.links * COLUMNS;
        let may = |(c, x): (usize, &f64)| {
            x.abs() < ROUNDING || (*x > 0.0 && c < links && POSITIVE.contains(&(c % COLUMNS)))
        };
        own.iter().enumerate().all(may)
    }

    /// Returns the warning about inertias and viscous friction below zero, however uncertain they are.
    pub(crate) fn below_zero(&self, robot: &Robot) -> Option<Warning> {
        let named = |(row, own): (usize, &BaseParameter)| {
            let standard = self.details.columns[row];
            let kind = standard % COLUMNS;
            let concerned = ![column::COULOMB, column::MASS].contains(&kind);
            // Motors that move several joints have no joint of their own.
            let link = standard / COLUMNS;
            let joint = self.joints.get(robot.joint_of_link(link)?)?;
            // Without noise a value of zero is a rounding error below it.
            let least = LEAST_ERROR / joint.train_relative_error;
            let rounding = least.is_finite() && least > 1.0 && -own.value <= least * own.std;
            let below = own.value < 0.0 && concerned && self.is_positive_sum(row);
            (below && !rounding).then(|| {
                format!(
                    "{} of joint \"{}\" is {} ± {} {}",
                    own.expression,
                    robot.link_name(link),
                    format_significant(own.value, 3),
                    format_significant(own.std, 2),
                    format_unit(&own.unit)
                )
            })
        };
        let list: Vec<String> = (self.base_parameters.iter().enumerate())
            .filter_map(named)
            .collect();
        (!list.is_empty()).then_some(Warning::BelowZero(list))
    }
}
