//! The design of poses.

use nalgebra::Vector3;
use rand_pcg::Pcg64;
use rig_shared::safety::Limits;
use rig_shared::trajectory::{Staircase, Trajectory};

use super::exchange::best_choice;
use super::information::{Information, best_value};
use super::route::Moves;
use super::space::{Pose, Space};
use crate::bounds::{Room, bounds_of};
use crate::error::wrong;
use crate::instants::{Instants, MOTOR_STEPS, TORQUE_STEPS};
use crate::motor_limits::exceeded;
use crate::quintic_move::micros;
use crate::torque_share::torque_share;
use crate::{Criterion, DesignRecord, ExciteError, JointTrajectory, TrajectoryFile};
use rig_model::robot::Robot;

/// Fewest and most poses. Unknown biases leave differences of gravity only: two poses give one difference, and a centre
/// of mass along it has no moment in either. A staircase has at most 16 levels.
const COUNT: std::ops::RangeInclusive<usize> = 3..=16;
/// Rest at each pose, s: one for the loop to settle, two for the mean of the readings.
const DWELL: f64 = 3.0;
/// Number of random poses to choose from: gravity is then within a few degrees of every possible direction.
const CANDIDATES: usize = 2000;
/// Number of choices that are tried if regions or torque limits block the moves.
const TRIALS: u64 = 10;
/// Factor by which moves are lengthened until their torque fits, and number of attempts.
const SLOWER: f64 = 1.2;
const ATTEMPTS: usize = 20;
/// Share of the information of all directions alike below which a direction counts as unknown.
const LEAST_SHARE: f64 = 1e-6;

/// Settings of a design of poses.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseOptions {
    /// Number of poses, 3 to 16.
    pub count: usize,
    /// Joint positions before and after the poses, rad or m; the first pose if absent.
    pub start: Option<Vec<f64>>,
    /// Free share of the position range, half of it at each end.
    pub margin: f64,
    /// Used share of the velocity limits, and its square of the acceleration limits.
    pub speed_share: f64,
    /// Seed of the random candidates.
    pub seed: u64,
}

/// Poses at rest for mass and centre of mass of a load.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses {
    /// The motion from pose to pose, ready to be saved and run.
    pub file: TrajectoryFile,
    /// Joint positions of the poses in the order of the motion, rad or m.
    pub positions: Vec<Vec<f64>>,
    /// Direction of gravity in the sensor's axes at each pose, unit vectors.
    pub gravity: Vec<[f64; 3]>,
    /// (det M/(g²)⁴)^(1/8) of the information M per pose of mass and first moment, with unknown biases and noises of one.
    pub value: f64,
    /// Its largest possible value: gravity spread over all directions alike.
    pub best_value: f64,
    /// Square root of the ratio of the largest to the smallest eigenvalue of M.
    pub condition_number: f64,
    /// Standard deviation of the mass, kg per N of force noise in the mean reading of a pose.
    pub mass_deviation: f64,
    /// Standard deviation of the first moment in its least certain direction, kg·m per N·m of moment noise in the mean
    /// reading of a pose.
    pub first_moment_deviation: f64,
    /// Rest at each pose, s.
    pub dwell: f64,
    /// Notes for the user, one sentence each.
    pub notes: Vec<String>,
}

/// Finds D-optimal poses at rest for mass and first moment of a load, with six unknown biases of the wrist sensor, and
/// a motion that visits them.
///
/// The poses are chosen by exchange among random candidates within the limits on position, torque at rest, cranks and
/// regions. Joints that do not turn gravity in the sensor's frame stay in the middle of their range, or at the start.
/// The moves are straight lines of the joint positions, in an order that makes them short, and are proved to stay
/// within the regions; the torque is checked at samples. The result depends on robot and options only.
///
/// Leaves out: the load's own weight in the torques of the joints, and collisions.
///
/// # Errors
/// [`ExciteError`]: no wrist sensor, options out of range, missing limits, gravity that does not turn, or no poses
/// within the limits.
pub fn poses(robot: &Robot, options: &PoseOptions) -> Result<Poses, ExciteError> {
    let Some(sensor) = &robot.wrist_sensor else {
        return Err(ExciteError::NoSensor {
            robot: robot.name.clone(),
        });
    };
    if !COUNT.contains(&options.count) {
        return Err(wrong(
            "number of poses",
            options.count.to_string(),
            "it must be between 3 and 16: with unknown biases only differences of gravity count, and two poses give one difference, along which a centre of mass has no moment in either; a motion has room for 16".into(),
        ));
    }
    let room = Room::new(options.margin, options.speed_share)?;
    let (bounds, mut notes) = bounds_of(robot, room, options.start.as_deref())?;
    let space = Space::new(robot, sensor, bounds)?;
    notes.push(if space.knows_torque {
        "The torque limit is kept for the robot as described, without the load that is to be identified.".to_owned()
    } else {
        "No torque limit was checked: [joint.limits] states none, or a joint has no [joint.inertial].".to_owned()
    });
    let start = start_of(&space, options)?;
    let strength = Vector3::from(robot.gravity).norm();
    let mut fault = (0, "workspace");
    for trial in 0..TRIALS {
        let chosen = choose(&space, options, start.as_ref(), trial)?;
        let gravity: Vec<Vector3<f64>> = chosen.iter().map(|pose| pose.gravity).collect();
        let information = Information::of(&gravity, strength);
        if !(information.value > 0.0 && information.condition_number < LEAST_SHARE.sqrt().recip()) {
            return Err(ExciteError::NoTilt);
        }
        let stops: Vec<Pose> = start.iter().cloned().chain(chosen).collect();
        let Some((tour, longest)) = Moves::of(&space, &stops)?.tour() else {
            fault = (
                space.planes.first().map_or(0, |plane| plane.link),
                "workspace",
            );
            continue;
        };
        let stops: Vec<&Pose> = tour.iter().map(|k| &stops[*k]).collect();
        let joints = match motion(&space, &stops, longest)? {
            Ok(joints) => joints,
            Err(at) => {
                fault = at;
                continue;
            }
        };
        let visited = &stops[usize::from(start.is_some())..];
        return Ok(found(
            robot,
            options.seed,
            visited,
            &information,
            joints,
            notes,
        ));
    }
    Err(space.infeasible(fault))
}

/// Returns the result for poses in the order of their visit.
fn found(
    robot: &Robot,
    seed: u64,
    visited: &[&Pose],
    information: &Information,
    joints: Vec<JointTrajectory>,
    notes: Vec<String>,
) -> Poses {
    Poses {
        file: TrajectoryFile {
            robot: robot.name.clone(),
            design: Some(DesignRecord {
                criterion: Criterion::Determinant,
                value: information.value,
                condition_number: information.condition_number,
                seed,
            }),
            drive_off: None,
            joints,
        },
        positions: visited.iter().map(|pose| pose.q.clone()).collect(),
        gravity: (visited.iter())
            .map(|pose| pose.gravity.normalize().into())
            .collect(),
        value: information.value,
        best_value: best_value(),
        condition_number: information.condition_number,
        mass_deviation: information.mass,
        first_moment_deviation: information.first_moment,
        dwell: DWELL,
        notes,
    }
}

/// Returns the given start as a pose.
fn start_of(space: &Space<'_>, options: &PoseOptions) -> Result<Option<Pose>, ExciteError> {
    let Some(start) = &options.start else {
        return Ok(None);
    };
    if start.len() != space.bounds.len() {
        return Err(wrong(
            "start",
            format!("{} numbers", start.len()),
            format!("the robot has {} joints", space.bounds.len()),
        ));
    }
    match space.violated(start)? {
        Some((joint, limit)) => Err(wrong(
            "start",
            format!("{start:?}"),
            format!(
                "it violates the {limit} limit of joint \"{}\", or its margin",
                space.robot.joints[joint].name
            ),
        )),
        None => Ok(Some(space.pose(start.clone()))),
    }
}

/// Returns the best poses among those of a trial.
fn choose(
    space: &Space<'_>,
    options: &PoseOptions,
    start: Option<&Pose>,
    trial: u64,
) -> Result<Vec<Pose>, ExciteError> {
    let candidates = space.draw(CANDIDATES, options.seed, 2 * trial)?;
    let mut random = Pcg64::new(u128::from(options.seed), u128::from(2 * trial + 1));
    let choice = best_choice(&candidates, options.count, &mut random);
    let home = start.map_or_else(|| space.middle(), |pose| pose.q.clone());
    choice
        .into_iter()
        .map(|k| space.settled(candidates[k].clone(), &home))
        .collect()
}

/// Returns the motion of each joint from stop to stop and back, with moves of at least `longest` seconds; the joint and
/// the limit at fault if even slow moves exceed a torque limit.
fn motion(
    space: &Space<'_>,
    stops: &[&Pose],
    longest: f64,
) -> Result<Result<Vec<JointTrajectory>, (usize, &'static str)>, ExciteError> {
    let mut moving = longest.max(0.1);
    let mut fault = (0, "velocity");
    for _ in 0..ATTEMPTS {
        let joints = staircases(space, stops, moving);
        moving *= SLOWER;
        let Some(joints) = joints else {
            continue;
        };
        if let Some(joint) = unfit(space, &joints) {
            fault = (joint, "velocity");
            continue;
        }
        if space.knows_torque {
            let share = torque_share(
                &space.model,
                &space.bounds,
                &Instants::of_joints(&joints, TORQUE_STEPS),
            )?;
            if share.is_nan() || share > 1.0 {
                fault = (0, "torque");
                continue;
            }
        }
        if let Some(used) = exceeded(
            space.robot,
            &space.model,
            &Instants::of_joints(&joints, MOTOR_STEPS),
            space.has_bodies,
        )? {
            fault = (used.joint, used.limit);
            continue;
        }
        return Ok(Ok(joints));
    }
    Ok(Err(fault))
}

/// Returns the staircases of all joints; none if a time does not fit.
fn staircases(space: &Space<'_>, stops: &[&Pose], moving: f64) -> Option<Vec<JointTrajectory>> {
    let (move_us, dwell_us) = (micros(moving)?, micros(DWELL)?);
    let (first, others) = stops.split_first()?;
    let joints = space.robot.joints.iter().enumerate();
    Some(
        joints
            .map(|(j, joint)| JointTrajectory {
                name: joint.name.clone(),
                start: first.q[j],
                trajectory: Trajectory::Staircase(Staircase {
                    levels: others.iter().map(|pose| pose.q[j] - first.q[j]).collect(),
                    move_us,
                    dwell_us,
                }),
            })
            .collect(),
    )
}

/// Returns the first joint whose motion leaves its limits of position, velocity or acceleration, in single precision as
/// on the rig.
fn unfit(space: &Space<'_>, joints: &[JointTrajectory]) -> Option<usize> {
    joints.iter().zip(&space.bounds).position(|(joint, b)| {
        let limits = Limits {
            position_low: b.low,
            position_high: b.high,
            velocity: b.velocity,
            acceleration: b.acceleration.unwrap_or(f64::MAX),
            ..Limits::default()
        };
        let rounded = joint.trajectory.to_f32().to_f64();
        rounded.check(&limits, joint.start).is_err()
    })
}
