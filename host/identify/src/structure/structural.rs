//! Base parameters by a numeric rank at random states.

use rig_shared::multibody::COLUMNS;
use rig_shared::transmission::MOTOR_COLUMNS;

use super::base::Base;
use super::columns::{column_name, preference};
use super::grouping::{agree, grouped};
use super::independent::independent_columns;
use super::states::States;
use crate::error::IdentifyError;
use crate::options::ModelKind;
use rig_model::robot::Robot;

/// Remainder of a column of unit length after projection onto the preceding columns, below which it is dependent.
/// Rounding leaves about 1e-14 at random states.
const DEPENDENT: f64 = 1e-10;
/// The same remainder above which a column is independent. A real geometry, whose right angles are exact after reading,
/// has no remainder between the two. One there is an error: a length or angle is zero only by intention.
const INDEPENDENT: f64 = 1e-7;

impl Base {
    /// Finds the base parameters of `robot` from random states of the equations to fit ([`ModelKind`]). Momentum and
    /// torque have the same base parameters. The momentum is the inertia term of the torque with velocities in place of
    /// accelerations. So a combination without torque changes no momentum, and none of the remaining terms either.
    ///
    /// # Errors
    /// [`IdentifyError::Model`] for an impossible geometry, [`IdentifyError::Undecided`] if a column is neither clearly
    /// dependent nor clearly independent.
    pub fn structural(robot: &Robot, model: ModelKind, seed: u64) -> Result<Self, IdentifyError> {
        let kinds = robot.link_kinds();
        let matrix = States::of(robot)?.rows(model, seed)?;
        let mut order = preference(&kinds);
        order.extend(order.len()..matrix.ncols());
        let found = independent_columns(&matrix, &order, DEPENDENT);
        if found.remainders.0 < INDEPENDENT {
            let left = |c: &usize| found.remainder[*c];
            let doubtful = found
                .kept
                .iter()
                .copied()
                .min_by(|a, b| left(a).total_cmp(&left(b)))
                .unwrap_or(0);
            let n = kinds.len();
            let link = match doubtful.checked_sub(n * COLUMNS) {
                None => doubtful / COLUMNS,
                Some(motor) => motor / MOTOR_COLUMNS,
            };
            return Err(IdentifyError::Undecided {
                column: column_name(doubtful, n),
                joint: robot.link_name(link).to_owned(),
                least: found.remainders.0,
                robot: robot.name.clone(),
            });
        }
        let numeric = Self {
            columns: found.kept,
            combination: found.combination,
            joints: (0..kinds.len())
                .filter_map(|k| robot.joint_of_link(k))
                .collect(),
            kinds,
            drives: robot.drive_kinds(),
        };
        Ok(match grouped(robot) {
            Ok(rules) if agree(&rules, &numeric) => numeric.with_coefficients_of(&rules),
            _ => numeric,
        })
    }

    /// Takes the coefficients of equivalent rules, which have no rounding errors from random states.
    fn with_coefficients_of(self, rules: &Self) -> Self {
        if self.columns == rules.columns {
            return Self {
                combination: rules.combination.clone(),
                ..self
            };
        }
        // The identity over the own columns makes the combination unique.
        let there = rules.combination.select_columns(&self.columns);
        match there.lu().solve(&rules.combination) {
            Some(combination) => Self {
                combination,
                ..self
            },
            None => self,
        }
    }
}
