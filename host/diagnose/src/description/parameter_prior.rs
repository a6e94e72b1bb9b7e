//! Nominal parameters that a refit may change.
//!
//! Base parameters can absorb a wrong gravity direction, zero angle or constant torque. If the description states such
//! a value, it is held. The data then show the difference as a named effect (a tilted base, an offset) instead of a
//! wrong parameter. If it states nothing, the parameter is free and the effect not testable. A constant torque is held at
//! zero alone: another value was identified, with a model that may have lacked the effects (a cogging torque shifts it),
//! so it is refitted like friction. It is held if readings with the drive off tell the constant of the sensor from it. On
//! several joints, parameters that the motion determines less well than the description are held, too.

use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::description::described_effects::DescribedEffects;
use crate::rows::nominal::Nominal;
use crate::rows::regression::{Column, Rows, combined};
use rig_model::robot::{Inertial, Quantity, Robot, Worth, worth};

/// A free direction in the space of base parameters: indices and factors.
pub(crate) type Direction = Vec<(usize, f64)>;

/// Free and held nominal parameters.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ParameterPrior {
    /// Directions that a refit changes.
    pub(crate) free: Vec<Direction>,
    /// Described base parameters.
    pub(crate) prior: Vec<f64>,
    /// Base parameters held at the prior, fully or except for one direction.
    pub(crate) held: Vec<usize>,
    /// True if the description states the links' inertia, so that a change of it has a meaning.
    pub(crate) stated: bool,
    /// True if the direction of gravity is held.
    pub(crate) gravity_held: bool,
    /// Free base parameters without a described value: constant torques if the format has none, friction and drive
    /// inertia with worthless values ([`worth`]). No estimate contradicts them.
    unstated: Vec<usize>,
    /// Per base parameter, standard deviations of the described value along independent directions; empty without any.
    uncertainty: Vec<Vec<f64>>,
}

impl ParameterPrior {
    /// Returns the free direction of a single link's first moment, if the direction of gravity is held.
    pub(crate) fn first_moment(&self, nominal: &Nominal) -> Option<usize> {
        let along = |d: &Direction| {
            let mut columns = d.iter().map(|(b, _)| nominal.base.columns[*b]);
            columns.all(|c| (1..=2).contains(&c))
        };
        (self.gravity_held)
            .then(|| self.free.iter().position(along))
            .flatten()
    }

    /// Creates the anchor of a robot whose description states `stated`.
    pub(crate) fn of(robot: &Robot, nominal: &Nominal, stated: &DescribedEffects) -> Self {
        let n = robot.joints.len();
        let prior = nominal.stated(robot);
        let inertial = states_links(robot);
        let (mut held, mut unstated) = (Vec::new(), Vec::new());
        let mut free: Vec<Direction> = Vec::new();
        let mut gravity = Direction::new();
        let of_gravity = |c: usize| {
            n == 1
                && inertial
                && (1..=2).contains(&c)
                && robot.joints[0].kind == rig_model::robot::JointKind::Revolute
        };
        for (k, &c) in nominal.base.columns.iter().enumerate() {
            let friction = robot
                .joints
                .get(c / COLUMNS)
                .and_then(|j| j.friction.as_ref());
            let offset = friction.filter(|_| c < n * COLUMNS && c % COLUMNS == column::OFFSET);
            if offset.is_some() && stated.no_offsets {
                unstated.push(k);
                free.push(vec![(k, 1.0)]);
            } else if offset.is_some_and(|f| f.offset != 0.0 && !stated.zeros_given) {
                // Some of it, or all, may be external, or may stand for what a model without the effects lacks.
                free.push(vec![(k, 1.0)]);
            } else if offset.is_some() {
                held.push(k);
            } else if of_gravity(c) {
                held.push(k);
                gravity.push((k, prior[k]));
            } else {
                if inertial && !states(robot, c, prior[k]) {
                    unstated.push(k);
                }
                free.push(vec![(k, 1.0)]);
            }
        }
        let size = gravity.iter().map(|g| g.1 * g.1).sum::<f64>().sqrt();
        let gravity_held = size > 0.0;
        if gravity_held {
            free.push(gravity.into_iter().map(|(k, g)| (k, g / size)).collect());
        } else {
            // A described balanced link gives no gravity to hold.
            held.retain(|k| !gravity.iter().any(|g| g.0 == *k));
            free.extend(gravity.into_iter().map(|(k, _)| vec![(k, 1.0)]));
        }
        Self {
            free,
            prior,
            held,
            stated: inertial,
            gravity_held,
            unstated,
            uncertainty: (0..nominal.base.len())
                .map(|k| {
                    robot
                        .uncertainty
                        .along(&nominal.base.expression(k))
                        .to_vec()
                })
                .collect(),
        }
    }

    /// Returns the number of independent directions of the described values' uncertainty.
    fn directions(&self) -> usize {
        self.uncertainty.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Returns the standard deviation of a free direction's described coefficient.
    pub(crate) fn described_std(&self, direction: usize) -> f64 {
        let terms = &self.free[direction];
        let along = |d: usize| {
            let own = |&(k, f): &(usize, f64)| f * self.uncertainty[k].get(d).unwrap_or(&0.0);
            terms.iter().map(own).sum::<f64>()
        };
        (0..self.directions())
            .map(|d| along(d).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// Returns the torque of one standard deviation of the described values along each independent direction.
    pub(crate) fn uncertain_torques(&self, rows: &Rows) -> Vec<Column> {
        (0..self.directions())
            .map(|d| {
                let terms = self.uncertainty.iter().zip(&rows.nominal);
                let own = terms.filter_map(|(list, column)| Some((column, *list.get(d)?)));
                combined(rows.joints(), own)
            })
            .collect()
    }

    /// Holds free single base parameters at their described values.
    pub(crate) fn hold(&mut self, parameters: &[usize]) {
        let alone = |d: &Direction| matches!(d.as_slice(), [(k, _)] if parameters.contains(k));
        self.free.retain(|direction| !alone(direction));
        self.held.extend(parameters);
    }

    /// Returns true if a free direction is a base parameter without a described value.
    pub(crate) fn is_unstated(&self, direction: usize) -> bool {
        matches!(self.free[direction].as_slice(), [(k, _)] if self.unstated.contains(k))
    }

    /// Returns true if the constant torque of a joint is held.
    pub(crate) fn holds_constant(&self, joint: usize, nominal: &Nominal) -> bool {
        let own = joint * COLUMNS + column::OFFSET;
        self.held.iter().any(|&k| nominal.base.columns[k] == own)
    }

    /// Returns the columns of the free directions.
    pub(crate) fn columns(&self, rows: &Rows) -> Vec<Column> {
        self.free
            .iter()
            .map(|direction| along(rows, direction))
            .collect()
    }

    /// Returns the torque of the held parameters.
    pub(crate) fn held_torque(&self, rows: &Rows) -> Column {
        along(rows, &self.fixed())
    }

    /// Returns the held parameters at their prior, orthogonal to the free directions.
    fn fixed(&self) -> Direction {
        let mut rest: Vec<f64> = vec![0.0; self.prior.len()];
        for &k in &self.held {
            rest[k] = self.prior[k];
        }
        for direction in &self.free {
            let along: f64 = direction.iter().map(|&(k, f)| rest[k] * f).sum();
            for &(k, f) in direction {
                rest[k] -= along * f;
            }
        }
        (rest.into_iter().enumerate())
            .filter(|(_, x)| x.abs() > 1e-12)
            .collect()
    }

    /// Returns base parameters without the held part, which was subtracted from the torque.
    pub(crate) fn beyond_held(&self, values: &[f64]) -> Vec<f64> {
        let mut rest = values.to_vec();
        for (k, x) in self.fixed() {
            rest[k] -= x;
        }
        rest
    }

    /// Returns base parameters from the free directions' coefficients.
    pub(crate) fn values(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.prior.len()];
        for (k, x) in self.fixed() {
            values[k] += x;
        }
        for (direction, c) in self.free.iter().zip(coefficients) {
            for &(k, f) in direction {
                values[k] += c * f;
            }
        }
        values
    }

    /// Returns the coefficients of the free directions at the prior.
    pub(crate) fn prior_coefficients(&self) -> Vec<f64> {
        self.free
            .iter()
            .map(|direction| direction.iter().map(|&(k, f)| self.prior[k] * f).sum())
            .collect()
    }
}

/// Returns true if the description states the inertia of its links: each has a mass, or the values are those of
/// combinations. Combinations leave masses at zero beside moments, and links without values are part of others.
fn states_links(robot: &Robot) -> bool {
    let links = || robot.joints.iter().map(|j| j.inertial.as_ref());
    let moves = |i: &Inertial| i.first_moment.iter().chain(&i.inertia).any(|x| *x != 0.0);
    let of_combinations = || links().flatten().any(|i| i.mass <= 0.0 && moves(i));
    let identified = || robot.identified.is_some() && links().flatten().any(moves);
    links().all(|i| i.is_some_and(|i| i.mass > 0.0)) || of_combinations() || identified()
}

/// Returns true if a standard column of `n` joints is friction of a joint or a motor.
pub(crate) fn is_friction(c: usize, n: usize) -> bool {
    match c.checked_sub(n * COLUMNS) {
        None => [column::VISCOUS, column::COULOMB].contains(&(c % COLUMNS)),
        Some(motor) => motor % MOTOR_COLUMNS != motor_column::INERTIA,
    }
}

/// Returns true if the `value` of a standard column is described. Always true except for friction and drive inertia.
fn states(robot: &Robot, c: usize, value: f64) -> bool {
    let n = robot.joints.len();
    let quantity = match is_friction(c, n) {
        true => Quantity::Friction,
        false if c < n * COLUMNS && c % COLUMNS == column::DRIVE_INERTIA => Quantity::DriveInertia,
        false => return true,
    };
    let place = |c: usize| match c.checked_sub(n * COLUMNS) {
        None => c / COLUMNS,
        Some(motor) => motor / MOTOR_COLUMNS,
    };
    let joint = robot.joints.get(place(c));
    let written = joint.is_some_and(|j| j.friction.is_some() || j.drive.is_some())
        || quantity == Quantity::DriveInertia;
    written && matches!(worth(quantity, robot.origin, value), Worth::Share(_))
}

/// Returns the nominal columns along a direction.
fn along(rows: &Rows, direction: &[(usize, f64)]) -> Column {
    let terms = direction.iter().map(|&(k, f)| (&rows.nominal[k], f));
    combined(rows.joints(), terms)
}
