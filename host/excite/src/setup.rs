//! The data common to all starts of a design, from robot and options.

use rig_shared::multibody::{COLUMNS, INERTIAL_PARAMETERS, column};

use crate::bounds::{Bounds, Room, bounds_of, named, prior};
use crate::drives::{Combined, Drives};
use crate::error::wrong;
use crate::feasible::refuse_unreachable;
use crate::frame::Frame;
use crate::identified::{SIZE_SEED, column_sizes, independent, load_names};
use crate::period::schedule_of;
use crate::workspace::planes_of;
use crate::wrist_chain::WristChain;
use crate::{ExciteError, Options, Parameters, Scaling};
use rig_identify::{Base, ModelKind};
use rig_model::robot::{JointKind, Robot, WristSensor};
use rig_model::simulate::{Model, SimulateError};

/// Noise of a wrist sensor's moments over that of its forces, m, if neither noise nor ranges are known: the order of
/// the sensor's radius, over which it measures both as strains.
const MOMENT_SHARE: f64 = 0.05;

/// Returns a hint, after a semicolon, if a start is outside its bounds and inside them as degrees; else nothing.
pub(crate) fn degrees(kind: JointKind, start: f64, [low, high]: [f64; 2]) -> String {
    let inside = |q: f64| low < q && q < high;
    let turned = kind == JointKind::Revolute && start.abs() > std::f64::consts::TAU;
    match turned && !inside(start) && inside(start.to_radians()) {
        true => format!(
            "; it looks like degrees: {start} degrees are {:.4} rad",
            start.to_radians()
        ),
        false => String::new(),
    }
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
                    "it must lie strictly between {} and {} for joint \"{}\": a motion swings to both sides of its start{}",
                    low,
                    high,
                    joint.name,
                    degrees(joint.kind, *value, [b.low, b.high])
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

/// Returns the noise of the forces and of the moments of a wrist sensor, up to a common factor: the given ones, or in
/// proportion to its ranges if both are described, or 1 N and 0.05 N·m.
pub(super) fn sensor_noise(
    sensor: &WristSensor,
    given: Option<[f64; 2]>,
) -> Result<[f64; 2], ExciteError> {
    if let Some(value) = given
        .iter()
        .flatten()
        .find(|v| !(v.is_finite() && **v > 0.0))
    {
        return Err(wrong(
            "sensor noise",
            value.to_string(),
            "a standard deviation must be greater than 0, in N for forces and N·m for moments"
                .into(),
        ));
    }
    let by_ranges = || {
        let share = sensor.moment_range? / sensor.force_range?;
        Some([1.0, share])
    };
    Ok(given.or_else(by_ranges).unwrap_or([1.0, MOMENT_SHARE]))
}

/// Sets columns and weights of the identified parameters. Returns their names, and a note on those that are not
/// identifiable.
fn identify(
    robot: &Robot,
    options: &Options,
    frame: &mut Frame,
) -> Result<(Vec<String>, Option<String>), ExciteError> {
    let own = robot.link_count() * COLUMNS;
    frame.weights = weights_of(robot, options, &frame.bounds)?;
    if options.parameters == Parameters::Load {
        return identify_load(robot, options, frame);
    }
    let mut base = Base::structural(robot, ModelKind::Differential, SIZE_SEED)?;
    if options.parameters == Parameters::Links {
        // A link's own columns are preferred over its drive's as representatives. So the remainder without the drives'
        // columns is a base of the links alone.
        base = base.restricted(|c| c < own && c % COLUMNS < column::DRIVE_INERTIA);
    }
    frame.columns.clone_from(&base.columns);
    Ok(((0..base.len()).map(|k| base.expression(k)).collect(), None))
}

/// The same for a load: by the wrist sensor if there is one, else by the joint torques, as parameters of the last link.
fn identify_load(
    robot: &Robot,
    options: &Options,
    frame: &mut Frame,
) -> Result<(Vec<String>, Option<String>), ExciteError> {
    let first = match &robot.wrist_sensor {
        Some(sensor) => {
            frame.wrist = Some(WristChain::of(robot, sensor).map_err(SimulateError::from)?);
            let [force, moment] = sensor_noise(sensor, options.sensor_noise)?.map(|s| 1.0 / s);
            frame.weights = vec![force, force, force, moment, moment, moment];
            0
        }
        None => robot.last_link() * COLUMNS,
    };
    frame.columns = (first..first + INERTIAL_PARAMETERS).collect();
    let is_independent = independent(frame)?;
    frame.columns.retain(|c| is_independent[c - first]);
    let of = |kept: bool| {
        let names = load_names().into_iter().zip(&is_independent);
        names
            .filter(move |(_, own)| **own == kept)
            .map(|(name, _)| name.to_owned())
    };
    let lost: Vec<String> = of(false).collect();
    let note = (!lost.is_empty()).then(|| {
        format!(
            "No motion of this robot identifies {} of a load by itself: it has no effect, or only one that the other parameters{} have too.",
            lost.join(", "),
            if frame.wrist.is_some() { " or the biases" } else { "" },
        )
    });
    Ok((of(true).collect(), note))
}

/// Returns the prior parameters if they are known, and notes on torque limits that are not kept.
fn torque_notes(
    robot: &Robot,
    options: &Options,
    bounds: &[Bounds],
    prior: Result<Vec<[f64; COLUMNS]>, String>,
) -> (Option<Vec<[f64; COLUMNS]>>, Vec<String>) {
    let mut notes = Vec::new();
    let limited = bounds.iter().any(|b| b.torque.is_some());
    match &prior {
        Err(joint) if limited => notes.push(format!(
            "The torque limit was not checked: joint \"{joint}\" has no [joint.inertial], so that its torque is not known beforehand."
        )),
        Ok(_) if limited && options.parameters == Parameters::Load => notes.push(
            "The torque limit is kept for the robot as described, without the load that is to be identified; for a heavy load, add a part of its mass to [joint.inertial] of the last joint, or give a lower --speed-share.".to_owned(),
        ),
        _ => {}
    }
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
    (prior.ok(), notes)
}

/// Returns the data common to all starts, the names of the identified parameters and notes for the user.
pub(super) fn frame_of(
    robot: &Robot,
    options: &Options,
) -> Result<(Frame, Vec<String>, Vec<String>), ExciteError> {
    let room = Room::new(options.margin, options.speed_share)?;
    let (bounds, mut notes) = bounds_of(robot, room, options.start.as_deref())?;
    let combined = Combined::of(robot);
    if let Some(start) = &options.start {
        check_start(robot, start, &bounds, &combined)?;
    }
    let mut model = Model::from_robot(robot)?;
    // Large, as its transmission holds room for all joints in lanes: not on the stack of every caller.
    let drives = Drives::of(robot, model.motors.take(), &bounds, room.speed)?.map(Box::new);
    let known = prior(robot, &model);
    refuse_unreachable(robot, &bounds, &combined, drives.as_deref(), known.is_ok())?;
    let schedule = schedule_of(robot, &bounds, options)?;
    let (parameters, on_torque) = torque_notes(robot, options, &bounds, known);
    notes.extend(on_torque);
    let motors = drives.as_ref().map_or(&[][..], |drives| &drives.limits);
    if parameters.is_none() && motors.iter().any(|m| m.torque.is_finite()) {
        notes.push("The torque limits of [joint.drive.limits] were not checked: not every joint has [joint.inertial], so the torques are not known beforehand.".to_owned());
    }
    let mut frame = Frame {
        lanes: robot.chain().map_err(SimulateError::from)?,
        planes: planes_of(robot),
        plain: model.chain,
        columns: Vec::new(),
        sizes: Vec::new(),
        weights: Vec::new(),
        wrist: None,
        parameters,
        drives,
        bounds,
        combined,
        schedule,
        fixed: options.start.clone(),
        criterion: options.criterion,
    };
    let (names, on_parameters) = identify(robot, options, &mut frame)?;
    notes.extend(on_parameters);
    frame.sizes = match options.scaling {
        Scaling::Sizes => column_sizes(&frame)?,
        Scaling::None => vec![1.0; frame.columns.len()],
    };
    Ok((frame, names, notes))
}
