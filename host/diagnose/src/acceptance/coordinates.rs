//! Coordinates of the motion, along which a residual may lie.

use crate::rows::nominal_torque::Predicted;
use crate::rows::regression::Rows;
use rig_data::prepare::central_difference;
use rig_data::runs::Run;
use rig_model::robot::{JointKind, Robot};
use rig_output::format_significant;

/// Coordinates of most laws.
const OF_LAWS: [&str; 4] = [VELOCITY, POSITION, ACCELERATION, DRIVE];
/// Velocity of the joint.
pub(crate) const VELOCITY: &str = "velocity";
/// Position of the joint.
pub(crate) const POSITION: &str = "position";
/// Acceleration of the joint.
pub(crate) const ACCELERATION: &str = "acceleration";
/// Torque of the drive.
pub(crate) const DRIVE: &str = "torque of the drive";
/// Torque on the gear, positive along the motion.
pub(crate) const LOAD: &str = "torque on the gear along the motion";
/// Derivative of the drive's torque.
pub(crate) const DRIVE_CHANGE: &str = "change of the drive's torque";
/// Travel since the last reversal, with the sign of the velocity.
pub(crate) const WAY: &str = "travel since the last reversal, by direction";
/// Temperature.
pub(crate) const TEMPERATURE: &str = "temperature";

/// The coordinate of friction drift.
pub(crate) const SINCE_START: &str = "time since the start, by direction";

/// A coordinate of one joint on the kept rows.
#[derive(Clone)]
pub(crate) struct Coordinate {
    /// Its name in words.
    pub(crate) name: String,
    /// Unit, ASCII.
    pub(crate) unit: &'static str,
    /// One value per row.
    pub(crate) values: Vec<f64>,
}

impl Coordinate {
    /// Returns true if laws of the library depend on it, so that a mismatch of a law follows it.
    pub(crate) fn is_of_a_law(&self) -> bool {
        OF_LAWS.contains(&self.name.as_str())
    }
}

/// Motion of a joint, from which its coordinates are formed.
struct Motion<'m> {
    rows: &'m Rows,
    runs: &'m [Run],
    predicted: &'m [Predicted],
    robot: &'m Robot,
    joint: usize,
}

impl Motion<'_> {
    /// Returns a coordinate from a signal of each run.
    fn coordinate(
        &self,
        name: &str,
        unit: &'static str,
        of: &dyn Fn(usize, &Run) -> Vec<f64>,
    ) -> Coordinate {
        let mut values = Vec::with_capacity(self.rows.count);
        for (r, run) in self.runs.iter().enumerate() {
            self.rows.thinning.pick(&of(r, run), &mut values);
        }
        Coordinate {
            name: name.to_owned(),
            unit,
            values,
        }
    }

    /// Returns velocity, position and acceleration.
    fn of_the_joint(&self) -> [Coordinate; 3] {
        let joint = self.joint;
        let p = self.robot.joints[joint].kind.units().0;
        let (v, a) = match self.robot.joints[joint].kind {
            JointKind::Revolute => ("rad/s", "rad/s^2"),
            JointKind::Prismatic => ("m/s", "m/s^2"),
        };
        [
            self.coordinate(VELOCITY, v, &|_, run| run.joints[joint].qd.clone()),
            self.coordinate(POSITION, p, &|_, run| run.joints[joint].q.clone()),
            self.coordinate(ACCELERATION, a, &|_, run| run.joints[joint].qdd.clone()),
        ]
    }

    /// Returns the motor's angle within a turn, if the joint has a gear, and within each of the `waves`.
    fn of_the_motor(&self, waves: &[f64]) -> Vec<Coordinate> {
        let joint = self.joint;
        let ratio = self.robot.joints[joint].gear_ratio();
        let angle = |order: f64| {
            let within = std::f64::consts::TAU;
            move |_: usize, run: &Run| -> Vec<f64> {
                (run.joints[joint].q.iter())
                    .map(|q| (order * ratio * q).rem_euclid(within))
                    .collect()
            }
        };
        let mut list = Vec::new();
        if ratio.abs() > 1.0 {
            list.push(self.coordinate("motor angle within a turn", "rad", &angle(1.0)));
        }
        for order in waves {
            let name = format!(
                "motor angle within one wave, {} to a turn",
                format_significant(*order, 3)
            );
            list.push(self.coordinate(&name, "rad", &angle(*order)));
        }
        list
    }

    /// Returns torques, times, travel and temperature.
    fn of_the_load(&self) -> Vec<Coordinate> {
        let Self {
            predicted, joint, ..
        } = *self;
        let (p, f) = self.robot.joints[joint].kind.units();
        let rate = match self.robot.joints[joint].kind {
            JointKind::Revolute => "N*m/s",
            JointKind::Prismatic => "N/s",
        };
        let mut list = vec![
            self.coordinate(LOAD, f, &|r, run| {
                (predicted[r].load[joint].iter().zip(&run.joints[joint].qd))
                    .map(|(l, v)| l * v.signum())
                    .collect()
            }),
            self.coordinate(DRIVE, f, &|r, _| predicted[r].torque[joint].clone()),
            // Friction drift has zero mean over both directions.
            self.coordinate(SINCE_START, "s", &|_, run| {
                (run.t.iter().zip(&run.joints[joint].qd))
                    .map(|(t, v)| v.signum() * (t - run.began))
                    .collect()
            }),
            self.coordinate(WAY, p, &|_, run| since_reversal(run, joint).0),
            self.coordinate(
                "time since the last reversal, by direction",
                "s",
                &|_, run| since_reversal(run, joint).1,
            ),
            self.coordinate(DRIVE_CHANGE, rate, &|r, run| {
                central_difference(&predicted[r].torque[joint], 1.0 / run.rate)
            }),
        ];
        if (self.runs.iter()).all(|r| r.joints[joint].temperature.is_some()) {
            list.push(self.coordinate(TEMPERATURE, "degC", &|_, run| {
                run.joints[joint].temperature.clone().unwrap_or_default()
            }));
        }
        list
    }

    /// Returns the velocities of the other joints.
    fn of_the_others(&self) -> impl Iterator<Item = Coordinate> {
        let others = (0..self.robot.joints.len()).filter(|other| *other != self.joint);
        others.map(|other| Coordinate {
            name: velocity_of(&self.robot.joints[other].name),
            unit: match self.robot.joints[other].kind {
                JointKind::Revolute => "rad/s",
                JointKind::Prismatic => "m/s",
            },
            values: self.runs.iter().fold(Vec::new(), |mut values, run| {
                self.rows.thinning.pick(&run.joints[other].qd, &mut values);
                values
            }),
        })
    }
}

/// Returns all coordinates of a joint. `waves` are the orders per motor turn of its effects: bins of a turn would
/// average a high order out.
pub(crate) fn coordinates(
    rows: &Rows,
    runs: &[Run],
    predicted: &[Predicted],
    robot: &Robot,
    joint: usize,
    waves: &[f64],
) -> Vec<Coordinate> {
    let motion = Motion {
        rows,
        runs,
        predicted,
        robot,
        joint,
    };
    let mut list = Vec::from(motion.of_the_joint());
    list.extend(motion.of_the_motor(waves));
    list.extend(motion.of_the_load());
    list.extend(motion.of_the_others());
    list
}

/// Returns the name of another joint's velocity as a coordinate.
pub(crate) fn velocity_of(joint: &str) -> String {
    format!("velocity of joint {joint}")
}

/// Returns travel and time since reversal, with the sign of the direction.
pub(crate) fn since_reversal(run: &Run, joint: usize) -> (Vec<f64>, Vec<f64>) {
    let j = &run.joints[joint];
    let (mut from, mut at, mut sign) = (0.0, 0.0, 0.0);
    let mut lists = (Vec::with_capacity(run.len()), Vec::with_capacity(run.len()));
    for k in 0..run.len() {
        if j.qd[k].signum() != sign {
            (from, at, sign) = (j.q[k], run.t[k], j.qd[k].signum());
        }
        lists.0.push(j.q[k] - from);
        lists.1.push(sign * (run.t[k] - at));
    }
    lists
}
