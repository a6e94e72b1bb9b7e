//! Data common to all starts of a design.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rig_shared::lanes::Lanes;
use rig_shared::multibody::{COLUMNS, Chain, column, differential_regressor};
use rig_shared::trajectory::HARMONICS;
use rig_shared::transmission::MOTOR_COLUMNS;

use super::criterion::Values;
use super::drives::{Combined, Drives};
use super::problem::LANES;
use super::schedule::{JointMotion, Schedule};
use super::workspace::{Plane, planes_of};
use super::{Criterion, ExciteError, Options, Parameters, Scaling};
use rig_identify::{Base, ModelKind};
use rig_model::robot::{Robot, sound};
use rig_model::simulate::{Model, SimulateError};

/// Number of states for the size of a column; the size is a unit and need not be precise.
const SIZE_STATES: usize = 4000;
/// Seed of these states and of those for the base parameters. Not the user's seed, so that results of different seeds
/// are comparable.
const SIZE_SEED: u64 = 1;

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

/// Data common to all starts.
pub(super) struct Frame {
    pub lanes: Chain<Lanes<LANES>>,
    pub plain: Chain<f64>,
    /// Regressor columns that represent the base parameters, in ascending order.
    pub columns: Vec<usize>,
    /// Size by which each of these columns is divided.
    pub sizes: Vec<f64>,
    /// Factor of each joint's rows.
    pub weights: Vec<f64>,
    /// Prior parameters, if the description has all of them.
    pub parameters: Option<Vec<[f64; COLUMNS]>>,
    /// Drives that are coupled or have a varying ratio.
    pub drives: Option<Drives>,
    pub bounds: Vec<Bounds>,
    /// Ranges of cranks.
    pub combined: Vec<Combined>,
    /// Planes that bound points of the links.
    pub planes: Vec<Plane>,
    pub schedule: Schedule,
    /// Start positions of the joints, unless free.
    pub fixed: Option<Vec<f64>>,
    pub criterion: Criterion,
}

/// Highest velocity for which a motion is sized, rad/s or m/s: above that of any robot joint.
const FASTEST: f64 = 1e4;

/// Shortest chosen period, s. Limits that mean "none" would give a motion of a fraction of a second, too short to
/// settle and to record.
const SHORTEST: f64 = 1.0;

/// Returns a period whose harmonics can use the limits. The fundamental is slow enough to sweep the position range at
/// the highest velocity. The fastest harmonic is at most where highest velocity and acceleration meet. The longest over
/// the joints, rounded up to 0.1 s, at least 1 s. The highest values are the limits. Without an acceleration limit they
/// are the torque limit's values, with the described inertia and viscous friction.
pub fn default_period(robot: &Robot, harmonics: usize) -> Result<f64, ExciteError> {
    period_within(&bounds_of(robot, Room::ALL, None)?.0, harmonics)
}

fn period_within(bounds: &[Bounds], harmonics: usize) -> Result<f64, ExciteError> {
    use core::f64::consts::TAU;
    let mut period = SHORTEST;
    for bounds in bounds {
        let [velocity, acceleration] = bounds.driven;
        let acceleration = bounds
            .acceleration
            .map_or(acceleration, |a| a.min(acceleration));
        let within = (acceleration * (bounds.high - bounds.low)).sqrt();
        let velocity = velocity.min(bounds.velocity).min(within);
        period = period
            .max(TAU * bounds.half() / velocity)
            .max(TAU * harmonics as f64 * velocity / acceleration);
    }
    // Rounding errors must not raise an exact tenth to the next.
    Ok((period * 10.0 - 1e-9).ceil() / 10.0)
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
    for (j, joint) in robot.joints.iter().enumerate() {
        let Some(limits) = joint.limits.as_ref() else {
            limitless.push(joint.name.clone());
            continue;
        };
        let [mut low, mut high] = limits.for_motions();
        if !low.is_finite() || !high.is_finite() {
            (low, high) = (-core::f64::consts::PI, core::f64::consts::PI);
            notes.push(format!(
                "Joint \"{}\" turns endlessly; the motion stays within one turn, -pi to pi.",
                joint.name
            ));
        } else {
            let stated = [low, high];
            let at = start.and_then(|s| s.get(j).copied());
            [low, high] = room.positions(stated, at);
            if room.margin > 0.0 && (low == stated[0] || high == stated[1]) {
                notes.push(format!(
                    "Joint \"{}\" starts within the margin of its position limit; on that side the motion keeps the limit itself.",
                    joint.name
                ));
            }
        }
        // A value beyond any drive often means "no limit"; a row weighted by it would be lost.
        let reachable = |limit: &f64| sound(*limit);
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
        if velocity < stated {
            notes.push(format!(
                "Joint \"{}\" cannot reach its velocity limit within its range at its acceleration limit; the motion is \
                 sized by the {velocity:.3} that it can reach (SI units).",
                joint.name
            ));
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
fn named(joints: &[&str]) -> String {
    let quoted: Vec<String> = joints.iter().map(|name| format!("\"{name}\"")).collect();
    let plural = if joints.len() == 1 { "" } else { "s" };
    format!("joint{plural} {}", quoted.join(", "))
}

/// Returns the prior parameters if every link has its own; otherwise the name of the first joint without.
pub(super) fn prior(robot: &Robot, model: &Model) -> Result<Vec<[f64; COLUMNS]>, String> {
    match robot.joints.iter().find(|j| j.inertial.is_none()) {
        Some(joint) => Err(joint.name.clone()),
        None => Ok(model.parameters.clone()),
    }
}

/// Returns the columns of the motors, n × 3n; empty if there are none.
fn motors_at(
    drives: Option<&Drives>,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
) -> Result<Vec<f64>, ExciteError> {
    let Some(drives) = drives else {
        return Ok(Vec::new());
    };
    let mut out = vec![0.0; q.len() * q.len() * MOTOR_COLUMNS];
    drives
        .plain
        .motor_columns(q, qd, qdd, &mut out)
        .map_err(SimulateError::from)?;
    Ok(out)
}

/// Returns the entry of base column `c` in the row of joint `j`; the motors' columns follow the joints'.
fn entry(own: &[f64], motors: &[f64], n: usize, j: usize, c: usize) -> f64 {
    match c.checked_sub(n * COLUMNS) {
        Some(m) => motors[j * n * MOTOR_COLUMNS + m],
        None => own[j * n * COLUMNS + c],
    }
}

/// Returns the root mean square of each base column over states within the limits.
fn column_sizes(
    chain: &Chain<f64>,
    drives: Option<&Drives>,
    columns: &[usize],
    bounds: &[Bounds],
    weights: &[f64],
    fastest: f64,
) -> Result<Vec<f64>, ExciteError> {
    let n = bounds.len();
    let width = n * COLUMNS;
    let mut random = rand_pcg::Pcg64::seed_from_u64(SIZE_SEED);
    let mut symmetric = |limit: f64| limit * (2.0 * random.random::<f64>() - 1.0);
    let mut squares = vec![0.0; columns.len()];
    let mut out = vec![0.0; n * width];
    let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for _ in 0..SIZE_STATES {
        for (j, b) in bounds.iter().enumerate() {
            q[j] = b.middle() + symmetric(b.half());
            qd[j] = symmetric(b.velocity);
            // Acceleration of the fastest harmonic at the velocity limit, if that is smaller.
            let reachable = b.velocity * fastest;
            qdd[j] = symmetric(b.acceleration.map_or(reachable, |a| a.min(reachable)));
        }
        differential_regressor(chain, &q, &qd, &qdd, &mut out)?;
        let motors = motors_at(drives, &q, &qd, &qdd)?;
        for (sum, c) in squares.iter_mut().zip(columns) {
            *sum += (0..n)
                .map(|j| (weights[j] * entry(&out, &motors, n, j, *c)).powi(2))
                .sum::<f64>();
        }
    }
    Ok(squares
        .iter()
        .map(|s| (s / SIZE_STATES as f64).sqrt())
        .collect())
}

/// Returns the singular values of a motion's regressor over one period at `samples` instants.
pub(super) fn values_of(
    frame: &Frame,
    motions: &[JointMotion],
    samples: usize,
) -> Result<Values, ExciteError> {
    let n = motions.len();
    let (p, width) = (frame.columns.len(), n * COLUMNS);
    let trajectories: Vec<_> = motions
        .iter()
        .map(|m| frame.schedule.trajectory(&m.coefficients))
        .collect();
    let mut scaled = DMatrix::zeros(samples * n, p);
    let mut plain = DMatrix::zeros(samples * n, p);
    let mut out = vec![0.0; n * width];
    let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for s in 0..samples {
        let micros = f64::from(frame.schedule.ramp_us)
            + f64::from(frame.schedule.period_us) * s as f64 / samples as f64;
        for j in 0..n {
            let at = trajectories[j].at(micros * 1e-6);
            q[j] = motions[j].base + at.position;
            qd[j] = at.velocity;
            qdd[j] = at.acceleration;
        }
        differential_regressor(&frame.plain, &q, &qd, &qdd, &mut out)?;
        let motors = motors_at(frame.drives.as_ref(), &q, &qd, &qdd)?;
        for j in 0..n {
            for (c, source) in frame.columns.iter().enumerate() {
                let entry = entry(&out, &motors, n, j, *source);
                plain[(s * n + j, c)] = entry;
                scaled[(s * n + j, c)] = entry * frame.weights[j] / frame.sizes[c];
            }
        }
    }
    let condition = |s: &DVector<f64>| s.max() / s.min();
    // The triangular factor has the same singular values and is far smaller.
    let singular_values = |m: DMatrix<f64>| m.qr().r().singular_values();
    let singular = singular_values(scaled);
    let root = (samples as f64).sqrt();
    let logs: f64 = singular.iter().map(|s| (s / root).ln()).sum();
    Ok(Values {
        condition_number: condition(&singular),
        smallest_singular_value: singular.min() / root,
        mean_singular_value: (logs / p as f64).exp(),
        si_condition_number: condition(&singular_values(plain)),
    })
}

fn micros(name: &'static str, seconds: f64) -> Result<u32, ExciteError> {
    let micros = (seconds * 1e6).round();
    // An hour: the trajectory's own times are 32 bits of microseconds.
    if (1e3..=3.6e9).contains(&micros) {
        Ok(micros as u32)
    } else {
        Err(ExciteError::Option {
            name,
            value: seconds.to_string(),
            right: "it must be between 0.001 and 3600 s".into(),
        })
    }
}

fn wrong(name: &'static str, value: String, right: String) -> ExciteError {
    ExciteError::Option { name, value, right }
}

fn schedule_of(bounds: &[Bounds], options: &Options) -> Result<Schedule, ExciteError> {
    if !(1..=HARMONICS).contains(&options.harmonics) {
        return Err(wrong(
            "number of harmonics",
            options.harmonics.to_string(),
            format!("it must be between 1 and {HARMONICS}"),
        ));
    }
    for (name, count) in [
        ("number of starts", options.starts),
        ("number of periods", u32::from(options.periods)),
    ] {
        if count == 0 {
            return Err(wrong(name, "0".into(), "there must be at least one".into()));
        }
    }
    let period = match options.period {
        Some(period) => period,
        None => period_within(bounds, options.harmonics)?,
    };
    let period_us = micros("period", period)?;
    let ramp_us = micros("ramp", options.ramp.unwrap_or(period))?;
    if ramp_us / 4 > period_us {
        return Err(wrong(
            "ramp",
            format!("{} s", f64::from(ramp_us) * 1e-6),
            format!("it must not be longer than four periods of {period} s"),
        ));
    }
    Ok(Schedule {
        period_us,
        ramp_us,
        periods: options.periods,
        harmonics: options.harmonics,
    })
}

fn check_start(
    robot: &Robot,
    start: &[f64],
    bounds: &[Bounds],
    combined: &[Combined],
) -> Result<(), ExciteError> {
    if start.len() != robot.joints.len() {
        return Err(wrong(
            "start",
            format!("{} numbers", start.len()),
            format!("the robot has {} joints", robot.joints.len()),
        ));
    }
    for ((value, b), joint) in start.iter().zip(bounds).zip(&robot.joints) {
        if !(b.low < *value && *value < b.high) {
            // The user's limits, without the margin.
            let stated = joint.limits.as_ref().map(|limits| limits.for_motions());
            let [low, high] = stated
                .filter(|range| range.iter().all(|v| v.is_finite()))
                .unwrap_or([b.low, b.high]);
            return Err(wrong(
                "start",
                value.to_string(),
                format!(
                    "it must lie strictly between {} and {} for joint \"{}\": a motion swings to both sides of its start",
                    low, high, joint.name
                ),
            ));
        }
    }
    for limit in combined {
        let value = limit.at(start.iter().copied());
        if !(limit.low < value && value < limit.high) {
            return Err(wrong(
                "start",
                format!("{start:?}"),
                format!(
                    "it puts the crank of joint \"{}\" at {value} rad, which can move between {} and {} (joint angles added up, without the crank's offset)",
                    robot.joints[limit.joint].name, limit.low, limit.high
                ),
            ));
        }
    }
    Ok(())
}

/// Returns the factors of the joints' rows: from their noise if known, else from their torque limits.
fn weights_of(
    robot: &Robot,
    options: &Options,
    bounds: &[Bounds],
) -> Result<Vec<f64>, ExciteError> {
    if let Some(noise) = &options.torque_noise {
        if noise.len() != robot.joints.len() {
            return Err(wrong(
                "torque noise",
                format!("{} numbers", noise.len()),
                format!("the robot has {} joints", robot.joints.len()),
            ));
        }
        if let Some(value) = noise.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            return Err(wrong(
                "torque noise",
                value.to_string(),
                "a standard deviation must be greater than 0, in N·m (N for a prismatic joint)"
                    .into(),
            ));
        }
        return Ok(noise.iter().map(|sigma| 1.0 / sigma).collect());
    }
    // Different units are comparable only if every joint has a torque limit.
    let comparable = options.scaling == Scaling::Sizes
        && bounds.len() > 1
        && bounds.iter().all(|b| b.torque.is_some());
    Ok(bounds
        .iter()
        .map(|b| match b.torque {
            Some(limit) if comparable => 1.0 / limit,
            _ => 1.0,
        })
        .collect())
}

pub(super) fn frame_of(
    robot: &Robot,
    options: &Options,
) -> Result<(Frame, Base, Vec<String>), ExciteError> {
    let room = Room::new(options.margin, options.speed_share)?;
    let (bounds, mut notes) = bounds_of(robot, room, options.start.as_deref())?;
    let schedule = schedule_of(&bounds, options)?;
    let combined = Combined::of(robot);
    if let Some(start) = &options.start {
        check_start(robot, start, &bounds, &combined)?;
    }
    let mut model = Model::from_robot(robot)?;
    let drives = Drives::of(robot, model.motors.take(), &bounds)?;
    let parameters = match prior(robot, &model) {
        Ok(parameters) => Some(parameters),
        Err(joint) => {
            if bounds.iter().any(|b| b.torque.is_some()) {
                notes.push(format!(
                    "The torque limit was not checked: joint \"{joint}\" has no [joint.inertial], so that its torque is not known beforehand."
                ));
            }
            None
        }
    };
    let unlimited: Vec<&str> = bounds
        .iter()
        .zip(&robot.joints)
        .filter(|(b, _)| b.torque.is_none())
        .map(|(_, joint)| joint.name.as_str())
        .collect();
    if !unlimited.is_empty() {
        notes.push(format!(
            "No torque limit in [joint.limits] of {}, so none was kept there.",
            named(&unlimited)
        ));
    }
    let own = robot.joints.len() * COLUMNS;
    let mut base = Base::structural(robot, ModelKind::Differential, SIZE_SEED)?;
    if options.parameters == Parameters::Links {
        // A link's own columns are preferred over its drive's as representatives. So the remainder without the drives'
        // columns is a base of the links alone.
        base = base.restricted(|c| c < own && c % COLUMNS < column::DRIVE_INERTIA);
    }
    let weights = weights_of(robot, options, &bounds)?;
    let fastest = schedule.omega() * options.harmonics as f64;
    let sizes = match options.scaling {
        Scaling::Sizes => column_sizes(
            &model.chain,
            drives.as_ref(),
            &base.columns,
            &bounds,
            &weights,
            fastest,
        )?,
        Scaling::None => vec![1.0; base.columns.len()],
    };
    let frame = Frame {
        lanes: Chain::new(&robot.geometry(), robot.gravity).map_err(SimulateError::from)?,
        planes: planes_of(robot),
        plain: model.chain,
        columns: base.columns.clone(),
        sizes,
        weights,
        parameters,
        drives,
        bounds,
        combined,
        schedule,
        fixed: options.start.clone(),
        criterion: options.criterion,
    };
    Ok((frame, base, notes))
}
