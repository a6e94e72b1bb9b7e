//! Motions of one joint with a purpose other than identification at large, sized by the robot's limits.

use rig_shared::multibody::{column, inverse_dynamics};
use rig_shared::safety::Limits;
use rig_shared::trajectory::{
    Chirp, Extremes, FrictionSweep, SlowReversals, Staircase, Sweep, Trajectory,
};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use super::drives::{Combined, into_cranks};
use super::frame::{Bounds, bounds_of, prior};
use super::{ExciteError, JointTrajectory, TrajectoryFile};
use crate::robot::Robot;
use crate::simulate::{Model, SimulateError};

/// Share of each limit that these motions use.
const SHARE: f64 = 0.8;
/// Factor by which velocity and acceleration are lowered until the torque fits, and how often.
const SLOWER: f64 = 0.85;
const ATTEMPTS: usize = 30;
/// Instants at which the torque is looked at; [`SHARE`] leaves room for what lies between them.
const TORQUE_SAMPLES: usize = 50_000;
/// Peaks of the quintic's velocity and acceleration, in distance over time and over time squared.
const QUINTIC: [f64; 2] = [1.875, 5.773_502_691_896_26];

/// What the motion is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StagedKind {
    /// Swept sine: frequency response, resonances.
    Chirp,
    /// Steps with dwell: gravity, holding torque, settling.
    Staircase,
    /// Slow triangles: presliding, breakaway, backlash.
    Reversals,
    /// Pairs of constant speeds: the friction map.
    Sweep,
}

impl StagedKind {
    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Chirp => "chirp",
            Self::Staircase => "staircase",
            Self::Reversals => "reversals",
            Self::Sweep => "sweep",
        }
    }
}

/// What a motion may use.
struct Allowance {
    /// To either side of the start.
    distance: f64,
    velocity: f64,
    acceleration: f64,
}

fn build(kind: StagedKind, a: &Allowance) -> Option<Trajectory<f64>> {
    use core::f64::consts::TAU;
    let micros = |seconds: f64| {
        let whole = (seconds * 1e6).ceil();
        (whole >= 1.0 && whole <= f64::from(u32::MAX)).then_some(whole as u32)
    };
    let move_time = |distance: f64| {
        let by_velocity = QUINTIC[0] * distance / a.velocity;
        by_velocity.max((QUINTIC[1] * distance / a.acceleration).sqrt())
    };
    match kind {
        StagedKind::Chirp => {
            // From where the amplitude is bounded by the range to well beyond where acceleration bounds it.
            let start_hz = 0.25 * a.velocity / (TAU * a.distance);
            let end_hz = (4.0 * a.acceleration / (TAU * a.velocity)).max(8.0 * start_hz);
            // About five turns in the slowest octave, so that the sweep is slow against its own frequency.
            let octaves = (end_hz / start_hz).log2();
            let duration = 5.0 * octaves / start_hz;
            Some(Trajectory::Chirp(Chirp {
                start_hz,
                end_hz,
                sweep: Sweep::Logarithmic,
                duration_us: micros(duration)?,
                ramp_us: micros(0.5 / start_hz)?,
                amplitude: a.distance,
                velocity: a.velocity,
                acceleration: a.acceleration,
                again: 0.0,
            }))
        }
        StagedKind::Staircase => {
            // Up to one end, down to the other, back up: every level but the ends from both sides.
            let quarters = [1, 2, 3, 4, 3, 2, 1, 0, -1, -2, -3, -4, -3, -2, -1];
            Some(Trajectory::Staircase(Staircase {
                levels: quarters
                    .iter()
                    .map(|k| a.distance * f64::from(*k) / 4.0)
                    .collect(),
                move_us: micros(move_time(0.25 * a.distance))?,
                dwell_us: 1_000_000,
            }))
        }
        StagedKind::Reversals => {
            // A hundredth of the velocity limit is below the Stribeck velocity of usual gears.
            let speed = 0.01 * a.velocity;
            // The turn's acceleration peaks at 3/2 of twice the speed over its length.
            let turn = (3.0 * speed / a.acceleration).max(0.1);
            let least = 2.0 * speed * turn;
            let amplitudes: Vec<f64> = [0.02, 0.1, 0.3]
                .into_iter()
                .map(|share| (share * a.distance).max(least))
                .collect();
            SlowReversals::new(speed, turn, &amplitudes, 2).map(Trajectory::SlowReversals)
        }
        StagedKind::Sweep => {
            let (slowest, count) = (0.025 * a.velocity, 12);
            let ratio = (a.velocity / slowest).powf(1.0 / f64::from(count - 1));
            let speeds: Vec<f64> = (0..count).map(|k| slowest * ratio.powi(k)).collect();
            // The acceleration of a ramp peaks at 3/2 of speed over length.
            let ramp = 1.5 * a.velocity / a.acceleration;
            // The slowest pass takes no longer than half a minute; the map needs levels, not distance.
            let travel = (2.0 * a.distance - a.velocity * ramp).min(30.0 * slowest);
            let half_span = 0.5 * (travel + a.velocity * ramp);
            FrictionSweep::new(&speeds, travel, ramp, 0.2, move_time(half_span))
                .map(Trajectory::FrictionSweep)
        }
    }
}

/// Largest share of a torque limit that is used, Coulomb friction counted in full; none where it is not known.
fn torque_share(
    model: &Model,
    bounds: &[Bounds],
    start: &[f64],
    moving: usize,
    trajectory: &Trajectory<f64>,
) -> Result<f64, ExciteError> {
    let n = bounds.len();
    let (mut q, mut qd, mut qdd) = (start.to_vec(), vec![0.0; n], vec![0.0; n]);
    let mut rows = model.parameters.clone();
    for row in &mut rows {
        row[column::COULOMB] = 0.0;
    }
    let mut tau = vec![0.0; n];
    let mut share = 0.0_f64;
    // Coulomb friction of the motors counts in full as well.
    let width = n * MOTOR_COLUMNS;
    let mut motors = vec![0.0; n * width];
    let duration = trajectory.duration();
    for k in 0..=TORQUE_SAMPLES {
        let at = trajectory.at(duration * k as f64 / TORQUE_SAMPLES as f64);
        q[moving] = start[moving] + at.position;
        (qd[moving], qdd[moving]) = (at.velocity, at.acceleration);
        inverse_dynamics(&model.chain, &rows, &q, &qd, &qdd, &mut tau)?;
        let mut coulomb: Vec<f64> = model
            .parameters
            .iter()
            .map(|row| row[column::COULOMB].abs())
            .collect();
        if let Some(drives) = &model.motors {
            let at = |e| ExciteError::from(SimulateError::from(e));
            let t = &drives.transmission;
            t.motor_columns(&q, &qd, &qdd, &mut motors).map_err(at)?;
            for (c, value) in drives.parameters.as_flattened().iter().enumerate() {
                if c % MOTOR_COLUMNS != motor_column::COULOMB {
                    for (j, torque) in tau.iter_mut().enumerate() {
                        *torque += motors[j * width + c] * value;
                    }
                }
            }
            t.motor_directions(&q, &mut motors[..n * n]).map_err(at)?;
            for (row, own) in motors[..n * n].chunks_exact(n).zip(&drives.parameters) {
                for (sum, along) in coulomb.iter_mut().zip(row) {
                    *sum += (along * own[motor_column::COULOMB]).abs();
                }
            }
        }
        for j in 0..n {
            if let Some(limit) = bounds[j].torque {
                share = share.max((tau[j].abs() + coulomb[j]) / limit);
            }
        }
    }
    Ok(share)
}

/// A motion of one joint (the first where `joint` is none), the others holding their place, within 80 % of the
/// limits. Joints stand at `start`, in the middle of their ranges where that is none.
///
/// Returns the file and what the user should know. Torque is looked at at samples, with the prior parameters, where
/// there are any; the optimal motions of [`super::design`] are proved instead.
///
/// # Errors
/// [`ExciteError`]: no limits, no such joint, or no room.
pub fn staged(
    robot: &Robot,
    kind: StagedKind,
    joint: Option<&str>,
    start: Option<&[f64]>,
) -> Result<(TrajectoryFile, Vec<String>), ExciteError> {
    let (bounds, mut notes) = bounds_of(robot)?;
    let combined = Combined::of(robot);
    if !robot.workspace.is_empty() {
        notes.push(
            "The regions in [[workspace]] were not checked: only a motion of kind fourier is designed within them."
                .into(),
        );
    }
    let moving = match joint {
        None => 0,
        Some(name) => robot.joint_index(name).ok_or_else(|| ExciteError::Option {
            name: "joint",
            value: format!("\"{name}\""),
            right: format!(
                "the robot's joints are {}",
                robot
                    .joints
                    .iter()
                    .map(|j| j.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
        })?,
    };
    let start = match start {
        None => {
            let mut middle: Vec<f64> = bounds.iter().map(|b| 0.5 * (b.low + b.high)).collect();
            into_cranks(&combined, &mut middle, 0.5);
            middle
        }
        Some(given) if given.len() == bounds.len() => given.to_vec(),
        Some(given) => {
            return Err(ExciteError::Option {
                name: "start",
                value: format!("{} numbers", given.len()),
                right: format!("the robot has {} joints", bounds.len()),
            });
        }
    };
    let no_room = |why: String| ExciteError::NoRoom {
        kind: kind.name(),
        joint: robot.joints[moving].name.clone(),
        why,
    };
    let b = bounds[moving];
    let mut distance = (b.high - start[moving]).min(start[moving] - b.low);
    for limit in &combined {
        let now = limit.at(start.iter().copied());
        let turn = limit.weights[moving].abs();
        if turn > 0.0 {
            distance = distance.min((limit.high - now).min(now - limit.low) / turn);
        }
    }
    let distance = SHARE * distance;
    if distance.is_nan() || distance <= 0.0 {
        return Err(no_room(format!(
            "it starts at {}, which leaves nothing between {} and {} or within the range of a crank; start it elsewhere",
            start[moving], b.low, b.high
        )));
    }
    let model = Model::from_robot(robot)?;
    let limited = bounds.iter().any(|b| b.torque.is_some());
    let known = match prior(robot, &model) {
        Ok(_) => true,
        Err(joint) => {
            if limited {
                notes.push(format!(
                    "The torque limit was not checked: joint \"{joint}\" has no [joint.inertial], so that its torque is not known beforehand."
                ));
            }
            false
        }
    };
    // Without an acceleration limit: the velocity limit is reached within a tenth of the way.
    let acceleration = b
        .acceleration
        .unwrap_or(5.0 * b.velocity * b.velocity / distance);
    let limits = Limits {
        position_low: b.low,
        position_high: b.high,
        velocity: b.velocity,
        acceleration: b.acceleration.unwrap_or(f64::MAX),
        ..Limits::default()
    };
    let mut factor = SHARE;
    let mut why = String::new();
    for _ in 0..ATTEMPTS {
        let allowance = Allowance {
            distance,
            velocity: factor * b.velocity,
            acceleration: factor * acceleration,
        };
        factor *= SLOWER;
        let Some(trajectory) = build(kind, &allowance) else {
            why = "its distances, speeds and times do not fit each other".into();
            continue;
        };
        // In single precision, as the rig runs it.
        let checked: Result<Extremes<f64>, _> =
            trajectory.to_f32().to_f64().check(&limits, start[moving]);
        if let Err(error) = checked {
            why = error.to_string();
            continue;
        }
        if known && limited {
            let share = torque_share(&model, &bounds, &start, moving, &trajectory)?;
            if share.is_nan() || share > 1.0 {
                why = format!(
                    "even slowly it needs {:.0} % of a torque limit; start it where gravity is weaker",
                    100.0 * share
                );
                continue;
            }
        }
        let hold = trajectory.duration_micros().min(u64::from(u32::MAX)) as u32;
        let file = TrajectoryFile {
            robot: robot.name.clone(),
            design: None,
            drive_off: None,
            joints: robot
                .joints
                .iter()
                .enumerate()
                .map(|(j, joint)| JointTrajectory {
                    name: joint.name.clone(),
                    start: start[j],
                    trajectory: if j == moving {
                        trajectory.clone()
                    } else {
                        Trajectory::Hold(hold)
                    },
                })
                .collect(),
        };
        return Ok((file, notes));
    }
    Err(no_room(why))
}
