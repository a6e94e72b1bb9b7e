//! Limits of the joints within which a motion is designed.

use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::DriveKind;

use crate::ExciteError;
use crate::error::wrong;
use crate::motor_limits::MotorBounds;
use rig_model::robot::{Joint, JointLimits, Robot, is_safe_magnitude};
use rig_model::simulate::Model;

/// Highest velocity for which a motion is sized, rad/s or m/s: above that of any robot joint.
const FASTEST: f64 = 1e4;

/// Bounds of a joint's motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Lowest position.
    pub low: f64,
    /// Highest position.
    pub high: f64,
    pub velocity: f64,
    pub acceleration: Option<f64>,
    pub torque: Option<f64>,
    /// Velocity and acceleration that the torque limit allows the described joint, if it has no acceleration limit;
    /// infinite if unknown.
    pub driven: [f64; 2],
}

impl Bounds {
    pub(super) fn half(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    pub(super) fn middle(&self) -> f64 {
        0.5 * (self.high + self.low)
    }
}

/// Margin of a motion within the limits, for the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Room {
    /// Free share of the position range, half of it at each end.
    pub margin: f64,
    /// Used share of the velocity limit; its square of the acceleration limit, as if time ran slower.
    pub speed: f64,
}

impl Room {
    /// The limits themselves.
    pub(super) const ALL: Self = Self {
        margin: 0.0,
        speed: 1.0,
    };

    /// # Errors
    /// [`ExciteError::Option`] if a share is invalid.
    pub(super) fn new(margin: f64, speed: f64) -> Result<Self, ExciteError> {
        if !(0.0..=0.95).contains(&margin) {
            return Err(wrong(
                "margin",
                margin.to_string(),
                "it must be a share of the position range between 0 and 0.95".into(),
            ));
        }
        if !(speed > 0.0 && speed <= 1.0) {
            return Err(wrong(
                "speed share",
                speed.to_string(),
                "it must be above 0 and at most 1".into(),
            ));
        }
        Ok(Self { margin, speed })
    }

    /// Returns the reference's position range; the limit itself on a side where `start` is already in the margin.
    fn positions(&self, [low, high]: [f64; 2], start: Option<f64>) -> [f64; 2] {
        let free = 0.5 * self.margin * (high - low);
        let (inner_low, inner_high) = (low + free, high - free);
        match start {
            Some(at) if low < at && at <= inner_low => [low, inner_high],
            Some(at) if inner_high <= at && at < high => [inner_low, high],
            _ => [inner_low, inner_high],
        }
    }
}

/// Returns the limits of all joints minus the controller's margin, and notes on missing limits.
pub(super) fn bounds_of(
    robot: &Robot,
    room: Room,
    start: Option<&[f64]>,
) -> Result<(Vec<Bounds>, Vec<String>), ExciteError> {
    let mut notes = Vec::new();
    let mut list = Vec::new();
    let mut boundless = Vec::new();
    let mut limitless = Vec::new();
    let simple = robot.drive_kinds().iter().all(|k| *k == DriveKind::Simple);
    for (j, joint) in robot.joints.iter().enumerate() {
        let Some(mut limits) = joint.limits.clone() else {
            limitless.push(joint.name.clone());
            continue;
        };
        // Motors that move several joints have their limits in the search and in its proof.
        if simple {
            notes.extend(narrowed(joint, &mut limits)?);
        }
        // A motion is sized by a speed, or by an acceleration within a range.
        if limits.known_velocity().is_none() && limits.acceleration.is_none() {
            limitless.push(joint.name.clone());
            continue;
        }
        let at = start.and_then(|s| s.get(j).copied());
        let ([low, high], note) = range(joint, &limits, room, at);
        notes.extend(note);
        // A value beyond any drive often means "no limit"; a row weighted by it would be lost.
        let reachable = |limit: &f64| is_safe_magnitude(*limit);
        let acceleration = limits
            .acceleration
            .filter(reachable)
            .map(|a| a * room.speed.powi(2));
        if acceleration.is_none() {
            boundless.push(joint.name.as_str());
        }
        // The fastest motion: from rest over the whole range to rest, at the highest acceleration.
        let within = acceleration.map_or(f64::INFINITY, |a| (a * (high - low)).sqrt());
        let stated = room.speed * limits.velocity;
        let velocity = stated.min(within);
        if velocity > FASTEST {
            return Err(ExciteError::Boundless {
                joint: joint.name.clone(),
                velocity,
            });
        }
        if velocity < stated && stated.is_finite() {
            notes.push(sized_by(&joint.name, velocity));
        }
        list.push(Bounds {
            low,
            high,
            velocity,
            acceleration,
            torque: limits.torque.filter(reachable),
            driven: [f64::INFINITY; 2],
        });
    }
    if !limitless.is_empty() {
        return Err(ExciteError::NoLimits { joints: limitless });
    }
    if !boundless.is_empty() {
        notes.push(format!(
            "No acceleration limit in [joint.limits] of {}; acceleration is bounded by velocity and harmonics only.",
            named(&boundless)
        ));
    }
    drive(robot, &mut list)?;
    Ok((list, notes))
}

/// Returns the range of a designed motion that begins `at` this position, with a note where it is not the stated one less the
/// margin.
fn range(
    joint: &Joint,
    limits: &JointLimits,
    room: Room,
    at: Option<f64>,
) -> ([f64; 2], Option<String>) {
    let stated = limits.for_motions();
    if !stated.iter().all(|end| end.is_finite()) {
        let note = format!(
            "Joint \"{}\" turns endlessly; the motion stays within one turn, -pi to pi.",
            joint.name
        );
        let turn = core::f64::consts::PI;
        return ([-turn, turn], Some(note));
    }
    let [low, high] = room.positions(stated, at);
    let is_wide = room.margin > 0.0 && (low == stated[0] || high == stated[1]);
    ([low, high], is_wide.then(|| starts_in_margin(&joint.name)))
}

fn starts_in_margin(joint: &str) -> String {
    format!(
        "Joint \"{joint}\" starts within the margin of its position limit; on that side the motion keeps the limit itself."
    )
}

fn sized_by(joint: &str, velocity: f64) -> String {
    format!(
        "Joint \"{joint}\" cannot reach its velocity limit within its range at its acceleration limit; the motion is \
         sized by the {velocity:.3} that it can reach (SI units)."
    )
}

/// Narrows the limits of a joint to those of its own motor at a constant ratio, and returns a note if they were wider.
fn narrowed(joint: &Joint, limits: &mut JointLimits) -> Result<Option<String>, ExciteError> {
    let Some(drive) = joint.drive.as_ref().filter(|d| d.limits.is_some()) else {
        return Ok(None);
    };
    let motor = MotorBounds::of(joint, 1.0);
    let ratio = drive.gear_ratio;
    let before = limits.clone();
    let [low, high] = limits.for_motions();
    let [one, other] = motor.range.map(|angle| (angle - drive.zero) / ratio);
    let range = [low.max(one.min(other)), high.min(one.max(other))];
    if !(range[0] < range[1]) {
        let [a, b] = [low, high].map(|q| drive.zero + ratio * q);
        return Err(ExciteError::MotorAngle {
            joint: joint.name.clone(),
            limit: motor.range,
            turned: [a.min(b), a.max(b)],
        });
    }
    if range != [low, high] {
        limits.soft_position = Some(range);
    }
    limits.velocity = limits.velocity.min(motor.velocity / ratio.abs());
    let torque = motor.torque * ratio.abs();
    if torque.is_finite() {
        limits.torque = Some(limits.torque.map_or(torque, |own| own.min(torque)));
    }
    Ok((before != *limits).then(|| {
        format!(
            "The motor of joint \"{}\" allows less than the joint's own limits ([joint.drive.limits]); the motion keeps position {:.4} to {:.4}, velocity {:.4}{} (SI units, at the joint).",
            joint.name,
            range[0],
            range[1],
            limits.velocity,
            limits.torque.map_or(String::new(), |t| format!(", torque {t:.4}"))
        )
    }))
}

/// Sets the values that torque limits allow mid-range, if links are described and acceleration limits are not.
fn drive(robot: &Robot, list: &mut [Bounds]) -> Result<(), ExciteError> {
    let model = Model::from_robot(robot)?;
    if prior(robot, &model).is_err() {
        return Ok(());
    }
    let middle: Vec<f64> = list.iter().map(Bounds::middle).collect();
    let mut mass = vec![0.0; middle.len().pow(2)];
    model.inertia_matrix(&middle, &mut mass)?;
    for (j, bounds) in list.iter_mut().enumerate() {
        if bounds.acceleration.is_some() {
            continue;
        }
        let viscous = model.parameters[j][column::VISCOUS];
        let reach = |per: f64| match bounds.torque {
            Some(torque) if per > 0.0 => torque / per,
            _ => f64::INFINITY,
        };
        bounds.driven = [reach(viscous), reach(mass[j * (middle.len() + 1)])];
    }
    Ok(())
}

/// "joint \"a\"", "joints \"a\", \"b\"".
pub(super) fn named(joints: &[&str]) -> String {
    let quoted: Vec<String> = joints.iter().map(|name| format!("\"{name}\"")).collect();
    let plural = if joints.len() == 1 { "" } else { "s" };
    format!("joint{plural} {}", quoted.join(", "))
}

/// Returns the prior parameters if every link has its own; otherwise the name of the first joint without.
pub(super) fn prior(robot: &Robot, model: &Model) -> Result<Vec<[f64; COLUMNS]>, String> {
    match (0..robot.link_count()).find(|link| robot.link_inertial(*link).is_none()) {
        Some(link) => Err(robot.link_name(link).to_owned()),
        None => Ok(model.parameters.clone()),
    }
}
