//! Data common to all starts of a design.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rig_shared::lanes::Lanes;
use rig_shared::multibody::{COLUMNS, Chain, column, differential_regressor};
use rig_shared::transmission::MOTOR_COLUMNS;

use crate::bounds::{Bounds, Room, bounds_of, named, prior};
use crate::criterion::Values;
use crate::drives::{Combined, Drives};
use crate::error::wrong;
use crate::lanes::LANES;
use crate::period::schedule_of;
use crate::schedule::{JointMotion, Schedule};
use crate::workspace::{Plane, planes_of};
use crate::{Criterion, ExciteError, Options, Parameters, Scaling};
use rig_identify::{Base, ModelKind};
use rig_model::robot::Robot;
use rig_model::simulate::{Model, SimulateError};

/// Number of states for the size of a column; the size is a unit and need not be precise.
const SIZE_STATES: usize = 4000;
/// Seed of these states and of those for the base parameters. Not the user's seed, so that results of different seeds
/// are comparable.
const SIZE_SEED: u64 = 1;

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

/// Rejects a start outside the limits of the joints or of the cranks.
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

/// Returns the data common to all starts, the base parameters and notes for the user.
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
