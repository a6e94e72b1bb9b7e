//! Which nominal parameters a refit may move.
//!
//! Gravity's direction, a zero angle and a constant torque can all be taken up by base parameters. Where the description
//! states such a value, it is held: what the data add to it is then an effect with a name (a tilted base, an offset)
//! instead of a silently wrong parameter. Where it states nothing, the parameter is free and the effect not testable. Of
//! several joints a motion leaves much open: what it tells less of than the description is held, too.

use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use super::rows::{Column, Nominal, Rows, combined};
use super::stated::Stated;
use rig_model::robot::{Quantity, Robot, Worth, worth};

/// A free direction in the space of base parameters: parameters and factors.
pub(super) type Direction = Vec<(usize, f64)>;

/// Free and held nominal parameters.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Anchor {
    /// What a refit moves.
    pub(super) free: Vec<Direction>,
    /// Base parameters as the description has them.
    pub(super) prior: Vec<f64>,
    /// Base parameters that are held at the prior, wholly or but for one direction.
    pub(super) held: Vec<usize>,
    /// Whether the description states the links' inertia, so that a change against it means something.
    pub(super) stated: bool,
    /// Whether the direction of gravity is held.
    pub(super) gravity_held: bool,
    /// Free base parameters that the description does not state, so that no value of theirs contradicts it: constant torques where
    /// its format has no place for them, friction where its values are worth nothing ([`worth`]).
    unstated: Vec<usize>,
}

impl Anchor {
    /// Place among the free directions of a single link's first moment, where the direction of gravity is held.
    pub(super) fn first_moment(&self, nominal: &Nominal) -> Option<usize> {
        let along = |d: &Direction| {
            let mut columns = d.iter().map(|(b, _)| nominal.base.columns[*b]);
            columns.all(|c| (1..=2).contains(&c))
        };
        (self.gravity_held)
            .then(|| self.free.iter().position(along))
            .flatten()
    }

    /// For a robot whose description states what `stated` has.
    pub(super) fn of(robot: &Robot, nominal: &Nominal, stated: &Stated) -> Self {
        let n = robot.joints.len();
        let prior = nominal.stated(robot);
        let inertial = robot
            .joints
            .iter()
            .all(|j| j.inertial.as_ref().is_some_and(|i| i.mass > 0.0));
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
            } else if offset.is_some_and(|f| f.offset != 0.0 && stated.pulls_told) {
                // Part of it, or all, may come from outside.
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
            // A link said to be balanced: nothing to hold its gravity to.
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
        }
    }

    /// Holds base parameters that were free by themselves at what the description states.
    pub(super) fn hold(&mut self, parameters: &[usize]) {
        let alone = |d: &Direction| matches!(d.as_slice(), [(k, _)] if parameters.contains(k));
        self.free.retain(|direction| !alone(direction));
        self.held.extend(parameters);
    }

    /// Whether a free direction is a constant torque that the description could not state.
    pub(super) fn is_unstated(&self, direction: usize) -> bool {
        matches!(self.free[direction].as_slice(), [(k, _)] if self.unstated.contains(k))
    }

    /// Whether the constant torque of a joint is held.
    pub(super) fn holds_constant(&self, joint: usize, nominal: &Nominal) -> bool {
        let own = joint * COLUMNS + column::OFFSET;
        self.held.iter().any(|&k| nominal.base.columns[k] == own)
    }

    /// Columns of the free directions.
    pub(super) fn columns(&self, rows: &Rows) -> Vec<Column> {
        self.free
            .iter()
            .map(|direction| along(rows, direction))
            .collect()
    }

    /// What the held parameters contribute to the torque.
    pub(super) fn held_torque(&self, rows: &Rows) -> Column {
        along(rows, &self.fixed())
    }

    /// What the held parameters contribute at their prior, in the space that the free directions leave.
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

    /// Base parameters less what of the held ones has been taken off the torque.
    pub(super) fn beyond_held(&self, values: &[f64]) -> Vec<f64> {
        let mut rest = values.to_vec();
        for (k, x) in self.fixed() {
            rest[k] -= x;
        }
        rest
    }

    /// Base parameters from the free directions' coefficients.
    pub(super) fn values(&self, coefficients: &[f64]) -> Vec<f64> {
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

    /// Coefficients of the free directions at the prior.
    pub(super) fn prior_coefficients(&self) -> Vec<f64> {
        self.free
            .iter()
            .map(|direction| direction.iter().map(|&(k, f)| self.prior[k] * f).sum())
            .collect()
    }
}

/// Whether a standard column of `n` joints is friction of a joint or a motor.
pub(super) fn is_friction(c: usize, n: usize) -> bool {
    match c.checked_sub(n * COLUMNS) {
        None => [column::VISCOUS, column::COULOMB].contains(&(c % COLUMNS)),
        Some(motor) => motor % MOTOR_COLUMNS != motor_column::INERTIA,
    }
}

/// Whether the `value` of a standard column is stated: what is neither friction nor inertia of a drive is.
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

/// The nominal columns along a direction.
fn along(rows: &Rows, direction: &[(usize, f64)]) -> Column {
    let terms = direction.iter().map(|&(k, f)| (&rows.nominal[k], f));
    combined(rows.joints(), terms)
}
