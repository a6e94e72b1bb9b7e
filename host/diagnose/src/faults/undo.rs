//! Possible faults of a recording, and the recording without them.

use crate::faults::rows::Rows;
use rig_model::robot::Robot;

/// Ratio up to which fitted factors are the same.
const ALIKE: f64 = 1.12;

/// Columns of the joints that are in another order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Columns {
    /// The torques alone.
    Torques,
    /// The positions alone.
    Positions,
    /// All columns of a joint.
    Joints,
}

/// Side of the gears on which columns were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// At the joints: values are those of another joint.
    Joint,
    /// At the motors: values of another joint passed the gear ratio of this one.
    Motor,
}

/// A way to undo a suspected fault.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Undo {
    /// A joint's torque times a factor; all joints for `None`.
    Torque(Option<usize>, f64),
    /// A joint's position times a factor; all joints for `None`.
    Position(Option<usize>, f64),
    /// The torques of all joints, each times a factor of its own.
    Torques(Vec<f64>),
    /// The positions of all joints, each times a factor of its own.
    Positions(Vec<f64>),
    /// Position and torque of a joint, both reversed.
    Both(usize),
    /// Columns in another order: those of joint j are in the place of joint `order[j]`.
    Order(Columns, Side, Vec<usize>),
    /// A joint's position from another zero: the angle to add, rad.
    Zero(usize, f64),
    /// A joint's torque earlier by a number of rows.
    Earlier(usize, i64),
    /// Seconds per unit of the clock.
    Clock(f64),
    /// Gravity of another direction, m/s² in frame 0.
    Gravity([f64; 3]),
    /// A joint's rotor with a wrong description.
    Rotor(usize),
    /// A torque recorded as a magnitude, and its probable sense in each row.
    Magnitude(usize, Vec<f64>),
}

impl Undo {
    /// Returns the rows without the fault.
    pub(crate) fn applied(&self, robot: &Robot, rows: &Rows) -> Rows {
        let mut rows = rows.clone();
        match *self {
            Self::Torque(joint, factor) => {
                for (j, tau) in rows.tau.iter_mut().enumerate() {
                    if joint.is_none_or(|k| k == j) {
                        scale(tau, factor);
                    }
                }
            }
            Self::Position(joint, factor) => rows = rows.rescaled(joint, factor),
            Self::Torques(ref factors) => {
                for (tau, factor) in rows.tau.iter_mut().zip(factors) {
                    scale(tau, *factor);
                }
            }
            Self::Positions(ref factors) => {
                for (j, factor) in factors.iter().enumerate() {
                    rows = rows.rescaled(Some(j), *factor);
                }
            }
            Self::Both(j) => {
                rows = rows.rescaled(Some(j), -1.0);
                scale(&mut rows.tau[j], -1.0);
            }
            Self::Order(which, side, ref order) => {
                rows = reordered(robot, &rows, (which, side), order);
            }
            Self::Zero(j, angle) => rows.q[j].iter_mut().for_each(|q| *q += angle),
            Self::Earlier(j, by) => {
                let tau = rows.tau[j].clone();
                let last = tau.len() as i64 - 1;
                for (k, to) in rows.tau[j].iter_mut().enumerate() {
                    *to = tau[(k as i64 + by).clamp(0, last) as usize];
                }
            }
            Self::Clock(unit) => {
                rows.period *= unit;
                rows.qd.iter_mut().for_each(|x| scale(x, 1.0 / unit));
                rows.qdd
                    .iter_mut()
                    .for_each(|x| scale(x, 1.0 / (unit * unit)));
            }
            Self::Magnitude(j, ref senses) => {
                for (tau, sense) in rows.tau[j].iter_mut().zip(senses) {
                    *tau *= sense;
                }
            }
            // These change the model, not the rows.
            Self::Gravity(_) | Self::Rotor(_) => {}
        }
        rows
    }

    /// Returns the robot without the fault.
    pub(crate) fn robot(&self, robot: &Robot) -> Robot {
        let mut robot = robot.clone();
        match *self {
            Self::Gravity(other) => robot.gravity = other,
            Self::Rotor(j) => {
                if let Some(drive) = &mut robot.joints[j].drive {
                    drive.rotor_inertia = 0.0;
                }
            }
            _ => {}
        }
        robot
    }

    /// Returns the rows at either end without a measurement.
    pub(crate) fn edge(&self) -> usize {
        match self {
            Self::Earlier(_, by) => by.unsigned_abs() as usize,
            _ => 0,
        }
    }

    /// Returns true if both are the same, except for a fitted factor.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Position(i, a), Self::Position(j, b)) => {
                i == j && (a / b).ln().abs() < ALIKE.ln()
            }
            // Both sides of the gears are one fault in words.
            (Self::Order(own, _, a), Self::Order(other, _, b)) => own == other && a == b,
            _ => self == other,
        }
    }

    /// Returns the joint whose torque signs come from a fit to them.
    pub(crate) fn guessed(&self) -> Option<usize> {
        match self {
            Self::Magnitude(j, _) => Some(*j),
            _ => None,
        }
    }

    /// Returns true if it concerns the sense of one joint's columns.
    pub(crate) fn is_of_sense(&self) -> bool {
        matches!(
            self,
            Self::Torque(Some(_), -1.0) | Self::Position(Some(_), -1.0) | Self::Both(_)
        )
    }

    /// Returns true if it is a joint's zero.
    pub(crate) fn is_of_zero(&self) -> bool {
        matches!(self, Self::Zero(..))
    }

    /// Returns true if it concerns the robot's description, not the rows.
    pub(crate) fn is_of_robot(&self) -> bool {
        matches!(self, Self::Gravity(_) | Self::Rotor(_))
    }
}

fn scale(column: &mut [f64], factor: f64) {
    column.iter_mut().for_each(|v| *v *= factor);
}

fn reordered(robot: &Robot, rows: &Rows, (which, side): (Columns, Side), order: &[usize]) -> Rows {
    let mut own = rows.clone();
    for (j, &from) in order.iter().enumerate().filter(|(j, from)| j != *from) {
        let share = match side {
            Side::Joint => 1.0,
            Side::Motor => robot.joints[j].gear_ratio() / robot.joints[from].gear_ratio(),
        };
        if which != Columns::Positions {
            own.tau[j].clone_from(&rows.tau[from]);
            scale(&mut own.tau[j], share);
        }
        if which != Columns::Torques {
            let columns = [
                (&mut own.q, &rows.q),
                (&mut own.qd, &rows.qd),
                (&mut own.qdd, &rows.qdd),
            ];
            for (to, all) in columns {
                to[j].clone_from(&all[from]);
                scale(&mut to[j], 1.0 / share);
            }
        }
    }
    own
}
