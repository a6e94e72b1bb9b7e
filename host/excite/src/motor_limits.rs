//! Limits of the motors, on their side of the gears.

use rig_shared::transmission::Transmission;

use crate::ExciteError;
use crate::instants::Instants;
use rig_model::robot::{Joint, Robot};
use rig_model::simulate::{Model, SimulateError};

/// Limits of a motor; infinite if there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MotorBounds {
    /// Lowest and highest angle, rad.
    pub range: [f64; 2],
    /// rad/s
    pub velocity: f64,
    /// N·m
    pub torque: f64,
}

impl MotorBounds {
    /// Returns the limits of a joint's motor with a share of its speed.
    pub(super) fn of(joint: &Joint, speed: f64) -> Self {
        let limits = joint.drive.as_ref().and_then(|drive| drive.limits.clone());
        let limits = limits.unwrap_or_default();
        Self {
            range: limits
                .position
                .unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
            velocity: limits.velocity.map_or(f64::INFINITY, |v| speed * v),
            torque: limits.torque.unwrap_or(f64::INFINITY),
        }
    }

    /// Returns the limits of all motors; empty if the description has none.
    pub(super) fn all(robot: &Robot, speed: f64) -> Vec<Self> {
        let stated = |joint: &Joint| joint.drive.as_ref().is_some_and(|d| d.limits.is_some());
        if !robot.joints.iter().any(stated) {
            return Vec::new();
        }
        let of = |joint| Self::of(joint, speed);
        robot.joints.iter().map(of).collect()
    }

    /// Returns true if an angle lies within the range.
    pub(super) fn has(&self, angle: f64) -> bool {
        self.range[0] <= angle && angle <= self.range[1]
    }

    /// Returns the middle of the range and its half, if it is limited.
    pub(super) fn middle_and_half(&self) -> Option<[f64; 2]> {
        let [low, high] = self.range;
        high.is_finite()
            .then_some([0.5 * (low + high), 0.5 * (high - low)])
    }
}

/// The most used limit of a motor.
pub(super) struct Used {
    /// Used share, 1.
    pub share: f64,
    /// Joint of the motor, from 0.
    pub joint: usize,
    /// Name of the limit.
    pub limit: &'static str,
}

impl Used {
    /// Returns the sentence on a motion that exceeds the limit.
    pub(super) fn why(&self, robot: &Robot) -> String {
        format!(
            "even slowly it needs {:.0} % of the {} limit of joint \"{}\" ([joint.drive.limits]); start it elsewhere, or make it smaller",
            100.0 * self.share,
            self.limit,
            robot.joints[self.joint].name
        )
    }
}

/// Returns the most used motor limit at instants of a motion; `None` if it exceeds none. The torque counts if all
/// links are described (`with_torque`).
pub(super) fn exceeded(
    robot: &Robot,
    model: &Model,
    instants: &Instants<'_>,
    with_torque: bool,
) -> Result<Option<Used>, ExciteError> {
    let limits = MotorBounds::all(robot, 1.0);
    if limits.is_empty() {
        return Ok(None);
    }
    let n = robot.joints.len();
    let wrong = |e| ExciteError::from(SimulateError::from(e));
    let transmission: Transmission<f64> = robot.transmission().map_err(wrong)?;
    let [
        mut q,
        mut qd,
        mut qdd,
        mut psi,
        mut psid,
        mut tau,
        mut motor,
    ] = [(); 7].map(|()| vec![0.0; n]);
    let mut most = Used {
        share: 0.0,
        joint: 0,
        limit: "motor angle",
    };
    for k in 0..instants.count() {
        instants.fill(k, &mut q, &mut qd, &mut qdd);
        transmission.motor_position(&q, &mut psi).map_err(wrong)?;
        transmission
            .motor_velocity(&q, &qd, &mut psid)
            .map_err(wrong)?;
        if with_torque {
            model.inverse_dynamics(&q, &qd, &qdd, &mut tau)?;
            transmission
                .motor_torque(&q, &tau, &mut motor)
                .map_err(wrong)?;
        }
        for (j, bounds) in limits.iter().enumerate() {
            let away = bounds
                .middle_and_half()
                .map_or(0.0, |[middle, half]| (psi[j] - middle).abs() / half);
            for (share, limit) in [
                (away, "motor angle"),
                (psid[j].abs() / bounds.velocity, "motor speed"),
                (motor[j].abs() / bounds.torque, "motor torque"),
            ] {
                if !(share <= most.share) {
                    most = Used {
                        share,
                        joint: j,
                        limit,
                    };
                }
            }
        }
    }
    Ok((!(most.share <= 1.0)).then_some(most))
}
