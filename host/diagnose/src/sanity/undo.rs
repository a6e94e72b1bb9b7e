//! What may have been done to a recording, and the recording without it.

use super::rows::Rows;
use rig_model::robot::Robot;

/// Fitted factors within this ratio are the same.
const ALIKE: f64 = 1.12;

/// Which columns of the joints stand in another order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Columns {
    /// The torques alone.
    Torques,
    /// The positions alone.
    Positions,
    /// All columns of a joint.
    Joints,
}

/// A way to take a suspected fault back.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Undo {
    /// A joint's torque times a factor; that of all joints where none is named.
    Torque(Option<usize>, f64),
    /// A joint's position times a factor; that of all joints where none is named.
    Position(Option<usize>, f64),
    /// Position and torque of a joint both counted the other way round.
    Both(usize),
    /// Columns in another order: those of joint j stand in the place of joint `order[j]`.
    Order(Columns, Vec<usize>),
    /// A joint's position counted from another zero: the angle to add, rad.
    Zero(usize, f64),
    /// A joint's torque that many rows earlier.
    Earlier(usize, i64),
    /// Seconds that each unit of the clock lasts.
    Clock(f64),
    /// Gravity of another direction, m/s² in frame 0.
    Gravity([f64; 3]),
    /// The rotor of a joint that the description gets wrong.
    Rotor(usize),
    /// A torque of which only the magnitude was recorded, and the sense that it probably had in each row.
    Magnitude(usize, Vec<f64>),
}

impl Undo {
    /// The rows without the fault.
    pub(super) fn applied(&self, robot: &Robot, rows: &Rows) -> Rows {
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
            Self::Both(j) => {
                rows = rows.rescaled(Some(j), -1.0);
                scale(&mut rows.tau[j], -1.0);
            }
            Self::Order(which, ref order) => rows = reordered(robot, &rows, which, order),
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
            // Of this the model speaks, not the rows.
            Self::Gravity(_) | Self::Rotor(_) => {}
        }
        rows
    }

    /// The robot without it.
    pub(super) fn robot(&self, robot: &Robot) -> Robot {
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

    /// Rows at either end that it has no measurement for.
    pub(super) fn edge(&self) -> usize {
        match self {
            Self::Earlier(_, by) => by.unsigned_abs() as usize,
            _ => 0,
        }
    }

    /// Whether both are the same but for a factor that was fitted.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Position(i, a), Self::Position(j, b)) => {
                i == j && (a / b).ln().abs() < ALIKE.ln()
            }
            _ => self == other,
        }
    }

    /// The joint whose torques are read as a fit to them has it.
    pub(super) fn guessed(&self) -> Option<usize> {
        match self {
            Self::Magnitude(j, _) => Some(*j),
            _ => None,
        }
    }

    /// Whether it is of the robot's description, not of the rows.
    pub(super) fn is_of_robot(&self) -> bool {
        matches!(self, Self::Gravity(_) | Self::Rotor(_))
    }
}

fn scale(column: &mut [f64], factor: f64) {
    column.iter_mut().for_each(|v| *v *= factor);
}

/// What was measured at the motors went through the ratio of the other joint.
fn reordered(robot: &Robot, rows: &Rows, which: Columns, order: &[usize]) -> Rows {
    let mut own = rows.clone();
    for (j, &from) in order.iter().enumerate().filter(|(j, from)| j != *from) {
        let share = robot.joints[j].gear_ratio() / robot.joints[from].gear_ratio();
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
