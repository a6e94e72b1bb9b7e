//! Motions of one joint for special purposes, sized by the robot's limits.

use core::f64::consts::TAU;

use rig_shared::safety::Limits;
use rig_shared::trajectory::{
    Chirp, Extremes, FrictionSweep, SPEEDS, SlowReversals, Staircase, Sweep, Trajectory,
};

use crate::bounds::{Bounds, Room, bounds_of, prior};
use crate::drives::{Combined, Drives, into_cranks};
use crate::error::used_share;
use crate::feasible::refuse_unreachable;
use crate::instants::{Instants, MOTOR_STEPS, TORQUE_STEPS};
use crate::motor_limits::exceeded;
use crate::quintic_move::{micros, move_time};
use crate::setup::degrees;
use crate::torque_share::torque_share;
use crate::{ExciteError, JointTrajectory, TrajectoryFile};
use rig_model::robot::{JointKind, Robot};
use rig_model::simulate::Model;
use rig_output::format_significant;

/// Ratio of a sweep's fastest speed to its slowest. Friction of gears weakens below 0.01 to 0.3 rad/s
/// (Armstrong-Hélouvry, Dupont & Canudas de Wit 1994), and joints reach some rad/s: the slowest passes must lie below
/// the former, the fastest at the latter. With a ratio of 40 the sweep of the one-link rig began at 0.12 rad/s and
/// could not show weakening at 0.025 rad/s.
const SPEED_SPAN: f64 = 200.0;
/// Time at constant speed of the fastest pass, s: 0.05 s for the controller to settle and twice that for the mean. All
/// passes have the same ends, so a longer time makes the slow ones longer.
const FASTEST_PASS: f64 = 0.15;
/// Default share of each limit that these motions use; for positions, of the distance from the start to the limit.
pub(super) const SHARE: f64 = 0.8;
/// Factor by which velocity and acceleration are lowered until the torque fits, and number of attempts.
pub(super) const SLOWER: f64 = 0.85;
pub(super) const ATTEMPTS: usize = 30;
/// Purpose of the motion.
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

/// User options of a motion; absent ones follow from the limits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StagedOptions {
    /// The joint that moves; the first if absent.
    pub joint: Option<String>,
    /// Positions of the joints, rad or m; the middle of their ranges if absent.
    pub start: Option<Vec<f64>>,
    /// Free share of the position range, half of it at each end. If absent, the motion uses 80 % of the distance from
    /// its start to the nearer limit.
    pub margin: Option<f64>,
    /// Used share of the velocity limit, and its square of the acceleration limit; 80 % of both if absent.
    pub speed_share: Option<f64>,
    /// Distance on either side of the start, rad or m.
    pub amplitude: Option<f64>,
    /// Reversals: the speed. Sweep: the slowest and the fastest. rad/s or m/s.
    pub speeds: Option<Vec<f64>>,
    /// Sweep: number of speeds.
    pub count: Option<usize>,
    /// Chirp: first and last frequency, Hz.
    pub band: Option<[f64; 2]>,
    /// Reversals: number of triangles, with two reversals each, at every amplitude.
    pub cycles: Option<u16>,
}

impl StagedOptions {
    /// Returns the slowest and fastest speed of a sweep, none if not given.
    fn span(&self) -> Option<[f64; 2]> {
        match self.speeds.as_deref() {
            Some(&[slowest, fastest]) => Some([slowest, fastest]),
            _ => None,
        }
    }

    /// Rejects a band that is none.
    pub(super) fn check_band(&self) -> Result<(), ExciteError> {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        match self.band {
            Some([low, high]) if !(positive(low) && low < high && positive(high)) => {
                Err(ExciteError::Option {
                    name: "band",
                    value: format!("{low},{high}"),
                    right: "it must be two frequencies above 0 Hz, the lower one first".to_owned(),
                })
            }
            _ => Ok(()),
        }
    }

    /// Band of a frequency response: from a frequency at which the range bounds the amplitude to one at which acceleration
    /// clearly does.
    pub(super) fn default_band(distance: f64, velocity: f64, acceleration: f64) -> [f64; 2] {
        let low = 0.25 * velocity / (TAU * distance);
        let high = 4.0 * acceleration / (TAU * velocity);
        [low, high.max(8.0 * low)]
    }

    /// Rejects invalid numbers and options that the kind does not use.
    fn check(&self, kind: StagedKind, unit: &str) -> Result<(), ExciteError> {
        let option = |name, value: String, right: &str| {
            Err(ExciteError::Option {
                name,
                value,
                right: right.to_owned(),
            })
        };
        let positive = |v: f64| v > 0.0 && v.is_finite();
        if let Some(amplitude) = self.amplitude.filter(|a| !positive(*a)) {
            return option(
                "amplitude",
                amplitude.to_string(),
                &format!("it must be above 0 {unit}"),
            );
        }
        if let Some(speeds) = &self.speeds {
            let given = format!("{speeds:?}");
            let fits = match (kind, speeds.as_slice()) {
                (StagedKind::Sweep, [slow, fast]) => {
                    positive(*slow) && slow < fast && positive(*fast)
                }
                (StagedKind::Reversals, [speed]) => positive(*speed),
                _ => false,
            };
            if !fits {
                return option(
                    "speed",
                    given,
                    &match kind {
                        StagedKind::Sweep => format!(
                            "a sweep takes two above 0, the slowest and the fastest, with a comma between them, {unit}/s"
                        ),
                        StagedKind::Reversals => {
                            format!("slow reversals take one above 0, {unit}/s")
                        }
                        _ => format!("a {} has none of its own", kind.name()),
                    },
                );
            }
        }
        self.check_band()?;
        if let Some(count) = self.count.filter(|n| !(2..=SPEEDS).contains(n)) {
            return option(
                "number of speeds",
                count.to_string(),
                &format!("it must be between 2 and {SPEEDS}"),
            );
        }
        if self.cycles == Some(0) {
            return option("number of cycles", "0".into(), "there must be at least one");
        }
        Ok(())
    }
}

/// Limits available to a motion.
struct Allowance<'a> {
    /// On either side of the start.
    distance: f64,
    velocity: f64,
    acceleration: f64,
    /// User options.
    asked: &'a StagedOptions,
}

impl Allowance<'_> {
    /// Returns the duration of a quintic move.
    fn move_time(&self, distance: f64) -> f64 {
        move_time(distance, self.velocity, self.acceleration)
    }

    /// Returns the motion, or the reason why there is none.
    fn build(&self, kind: StagedKind) -> Result<Trajectory<f64>, String> {
        self.micros(self.distance / self.velocity)?;
        match kind {
            StagedKind::Chirp => self.chirp(),
            StagedKind::Staircase => self.staircase(),
            StagedKind::Reversals => self.reversals(),
            StagedKind::Sweep => self.sweep(),
        }
    }

    /// Rounds a time up to whole microseconds, or returns the reason why a motion cannot have it.
    fn micros(&self, seconds: f64) -> Result<u32, String> {
        micros(seconds).ok_or_else(|| {
            format!(
                "a part of it would take {} s, and none may take more than {:.0} s: it moves {} to either side, at {} per second at most (the velocity limit, less a margin); correct the limits, or give another amplitude, speed or band",
                format_significant(seconds, 3),
                1e-6 * f64::from(u32::MAX),
                format_significant(self.distance, 3),
                format_significant(self.velocity, 3),
            )
        })
    }

    fn chirp(&self) -> Result<Trajectory<f64>, String> {
        let [start_hz, end_hz] = self.asked.band.unwrap_or_else(|| {
            StagedOptions::default_band(self.distance, self.velocity, self.acceleration)
        });
        // About five periods in the slowest octave, so that the sweep is slow compared with its own frequency.
        let octaves = (end_hz / start_hz).log2();
        let duration = 5.0 * octaves / start_hz;
        Ok(Trajectory::Chirp(Chirp {
            start_hz,
            end_hz,
            sweep: Sweep::Logarithmic,
            duration_us: self.micros(duration)?,
            ramp_us: self.micros(0.5 / start_hz)?,
            amplitude: self.distance,
            velocity: self.velocity,
            acceleration: self.acceleration,
            again: 0.0,
        }))
    }

    fn staircase(&self) -> Result<Trajectory<f64>, String> {
        // Up to one end, down to the other, back up: every level except the ends from both sides.
        let quarters = [1, 2, 3, 4, 3, 2, 1, 0, -1, -2, -3, -4, -3, -2, -1];
        Ok(Trajectory::Staircase(Staircase {
            levels: quarters
                .iter()
                .map(|k| self.distance * f64::from(*k) / 4.0)
                .collect(),
            move_us: self.micros(self.move_time(0.25 * self.distance))?,
            dwell_us: 1_000_000,
        }))
    }

    fn reversals(&self) -> Result<Trajectory<f64>, String> {
        // A hundredth of the velocity limit is below the Stribeck velocity of usual gears.
        let asked = self.asked.speeds.as_ref().and_then(|s| s.first().copied());
        let speed = asked.unwrap_or(0.01 * self.velocity);
        // The acceleration of a reversal peaks at 3/2 of twice the speed over its duration.
        let turn = (3.0 * speed / self.acceleration).max(0.1);
        let least = 2.0 * speed * turn;
        // The largest amplitude: 30 % of the available distance, or the user's.
        let largest = self.asked.amplitude.unwrap_or(0.3 * self.distance);
        let amplitudes: Vec<f64> = [1.0 / 15.0, 1.0 / 3.0, 1.0]
            .into_iter()
            .map(|share| (share * largest).max(least))
            .collect();
        let cycles = self.asked.cycles.unwrap_or(2);
        self.micros(largest / speed)?;
        SlowReversals::new(speed, turn, &amplitudes, cycles)
            .map(Trajectory::SlowReversals)
            .ok_or_else(|| {
                format!(
                    "{amplitudes:.3?} to either side leave no time at {speed:.3} per second between turns of {turn:.3} s; give a larger --amplitude or a lower --speed"
                )
            })
    }

    fn sweep(&self) -> Result<Trajectory<f64>, String> {
        let default = [self.velocity / SPEED_SPAN, self.velocity];
        let [slowest, fastest] = self.asked.span().unwrap_or(default);
        let count = self.asked.count.unwrap_or(12).max(2);
        let ratio = (fastest / slowest).powf(1.0 / (count - 1) as f64);
        let speeds: Vec<f64> = (0..count).map(|k| slowest * ratio.powi(k as i32)).collect();
        // The acceleration of a ramp peaks at 3/2 of the speed over its duration.
        let ramp = 1.5 * fastest / self.acceleration;
        let whole = 2.0 * self.distance - fastest * ramp;
        // The map needs different speeds, not distance.
        let travel = if self.asked.amplitude.is_some() {
            whole
        } else {
            whole.min(FASTEST_PASS * fastest)
        };
        let half_span = 0.5 * (travel + fastest * ramp);
        self.micros(2.0 * half_span / slowest)?;
        FrictionSweep::new(&speeds, travel, ramp, 0.2, self.move_time(half_span))
            .map(Trajectory::FrictionSweep)
            .ok_or_else(|| {
                format!(
                    "at {fastest:.3} per second it needs all of its {:.3} to either side to reach its speed; give a lower --speed or a larger --amplitude",
                    self.distance
                )
            })
    }
}

/// Duration above which a motion gets a note, s.
const LONG: f64 = 400.0;

/// The joint that moves.
fn moving_joint(robot: &Robot, joint: Option<&str>) -> Result<usize, ExciteError> {
    let Some(name) = joint else {
        return Ok(0);
    };
    robot.joint_index(name).ok_or_else(|| ExciteError::Option {
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
    })
}

/// Returns the positions of the joints.
fn start_of(
    given: Option<&[f64]>,
    bounds: &[Bounds],
    combined: &[Combined],
) -> Result<Vec<f64>, ExciteError> {
    match given {
        None => {
            let mut middle: Vec<f64> = bounds.iter().map(|b| 0.5 * (b.low + b.high)).collect();
            into_cranks(combined, &mut middle, 0.5);
            Ok(middle)
        }
        Some(given) if given.len() == bounds.len() => Ok(given.to_vec()),
        Some(given) => Err(ExciteError::Option {
            name: "start",
            value: format!("{} numbers", given.len()),
            right: format!("the robot has {} joints", bounds.len()),
        }),
    }
}

/// Returns the available distance on either side of the start, or the reason why there is none.
fn distance_of(
    options: &StagedOptions,
    bounds: &Bounds,
    combined: &[Combined],
    start: &[f64],
    (moving, kind): (usize, JointKind),
) -> Result<f64, String> {
    let at = start[moving];
    let own = (bounds.high - at).min(at - bounds.low);
    let mut room = own;
    for limit in combined {
        let now = limit.at(start.iter().copied());
        let turn = limit.weights[moving].abs();
        if turn > 0.0 {
            room = room.min((limit.high - now).min(now - limit.low) / turn);
        }
    }
    // A margin is already subtracted from the bounds.
    let share = if options.margin.is_some() { 1.0 } else { SHARE };
    let most = share * room;
    if most.is_nan() || most <= 0.0 {
        let where_to = match own > 0.0 {
            true => "within the range of a crank".to_owned(),
            false => format!("between {} and {}", bounds.low, bounds.high),
        };
        return Err(format!(
            "it starts at {at}, which leaves nothing {where_to}; start it elsewhere{}",
            degrees(kind, at, [bounds.low, bounds.high])
        ));
    }
    match options.amplitude {
        Some(asked) if asked > most => Err(format!(
            "the amplitude is {asked}, but from its start at {at} it may go {most:.4} to either side (position limits less the margin); give less, another --start or --margin"
        )),
        Some(asked) => Ok(asked),
        None => Ok(most),
    }
}

/// Rejects speeds above the limits.
fn refuse_fast(options: &StagedOptions, bounds: &Bounds) -> Result<(), ExciteError> {
    let share = options.speed_share.unwrap_or(1.0);
    let fastest = options.speeds.iter().flatten().copied().fold(0.0, f64::max);
    if fastest <= bounds.velocity {
        return Ok(());
    }
    Err(ExciteError::Option {
        name: "speed",
        value: fastest.to_string(),
        right: format!(
            "the velocity limit is {:.4}{}",
            bounds.velocity / share,
            used_share(share)
        ),
    })
}

/// Designs a motion of one joint, with the others at rest, within 80 % of the limits or as `options` require.
///
/// Returns the file and notes for the user. Torque is checked at samples, with the prior parameters if there are any;
/// the optimal motions of [`crate::design`] are proved instead.
///
/// # Errors
/// [`ExciteError`]: no limits, no such joint, options out of range, or no room.
pub fn staged(
    robot: &Robot,
    kind: StagedKind,
    options: &StagedOptions,
) -> Result<(TrajectoryFile, Vec<String>), ExciteError> {
    let mut ready = Prepared::new(robot, kind.name(), options, |unit| {
        options.check(kind, unit)
    })?;
    let trajectory = ready.fastest(kind, options)?;
    let file = file_of(robot, ready.moving, &ready.start, &trajectory);
    if file.duration() > LONG {
        ready.notes.push(format!(
            "The motion lasts {:.0} s, as long as slow motion over this range takes; --amplitude{} it.",
            file.duration(),
            match kind {
                StagedKind::Chirp => " or a --band that begins higher shortens",
                StagedKind::Staircase => " shortens",
                StagedKind::Reversals | StagedKind::Sweep => " or a higher --speed shortens",
            }
        ));
    }
    Ok((file, ready.notes))
}

/// One joint of a robot at rest, and the limits available to its motion.
pub(super) struct Prepared<'a> {
    pub(super) robot: &'a Robot,
    /// Name of the kind of motion.
    kind: &'static str,
    /// Index of the joint.
    pub(super) moving: usize,
    pub(super) bounds: Vec<Bounds>,
    pub(super) start: Vec<f64>,
    /// Available distance on either side of the start.
    pub(super) distance: f64,
    /// Remarks on limits that were not checked.
    pub(super) notes: Vec<String>,
    model: Model,
    /// True if the torque of a motion is known beforehand.
    with_torque: bool,
}

impl<'a> Prepared<'a> {
    /// `check` rejects options; it gets the unit of the joint's position.
    pub(super) fn new(
        robot: &'a Robot,
        kind: &'static str,
        options: &StagedOptions,
        check: impl Fn(&str) -> Result<(), ExciteError>,
    ) -> Result<Self, ExciteError> {
        let moving = moving_joint(robot, options.joint.as_deref())?;
        check(match robot.joints.get(moving).map(|j| j.kind) {
            Some(JointKind::Prismatic) => "m",
            _ => "rad",
        })?;
        let room = Room::new(
            options.margin.unwrap_or(0.0),
            options.speed_share.unwrap_or(1.0),
        )?;
        let (bounds, mut notes) = bounds_of(robot, room, options.start.as_deref())?;
        let combined = Combined::of(robot);
        if !robot.workspace.is_empty() {
            notes.push(
                "The regions in [[workspace]] were not checked: only a motion of kind fourier is designed within them."
                    .into(),
            );
        }
        let mut model = Model::from_robot(robot)?;
        let known = prior(robot, &model);
        let with_torque = known.is_ok();
        let limited = bounds.iter().any(|b| b.torque.is_some());
        if let (Err(joint), true) = (&known, limited) {
            notes.push(format!(
                "The torque limit was not checked: joint \"{joint}\" has no [joint.inertial], so that its torque is not known beforehand."
            ));
        }
        let drives = Drives::of(robot, model.motors.take(), &bounds, 1.0)?;
        refuse_unreachable(robot, &bounds, &combined, drives.as_ref(), with_torque)?;
        let start = start_of(options.start.as_deref(), &bounds, &combined)?;
        let mut ready = Self {
            robot,
            kind,
            moving,
            bounds,
            start,
            distance: 0.0,
            notes,
            model: Model::from_robot(robot)?,
            with_torque,
        };
        refuse_fast(options, &ready.bounds[moving])?;
        ready.distance = distance_of(
            options,
            &ready.bounds[moving],
            &combined,
            &ready.start,
            (moving, robot.joints[moving].kind),
        )
        .map_err(|why| ready.no_room(why))?;
        Ok(ready)
    }

    /// Returns the error of a motion that does not fit.
    pub(super) fn no_room(&self, why: String) -> ExciteError {
        ExciteError::NoRoom {
            kind: self.kind,
            joint: self.robot.joints[self.moving].name.clone(),
            why,
        }
    }

    /// Acceleration limit. Without one the velocity limit is reached within a tenth of the distance.
    pub(super) fn acceleration(&self) -> f64 {
        let b = self.bounds[self.moving];
        (b.acceleration).unwrap_or(5.0 * b.velocity * b.velocity / self.distance)
    }

    /// Returns why a motion exceeds a limit of torque or of a motor.
    pub(super) fn overloaded(
        &self,
        for_torque: &Instants<'_>,
        for_motors: &Instants<'_>,
    ) -> Result<Option<String>, ExciteError> {
        if self.with_torque && self.bounds.iter().any(|b| b.torque.is_some()) {
            let share = torque_share(&self.model, &self.bounds, for_torque)?;
            if share.is_nan() || share > 1.0 {
                return Ok(Some(format!(
                    "even slowly it needs {:.0} % of a torque limit; start it where gravity is weaker",
                    100.0 * share
                )));
            }
        }
        let used = exceeded(self.robot, &self.model, for_motors, self.with_torque)?;
        Ok(used.map(|used| used.why(self.robot)))
    }

    /// Finds the fastest motion of a kind whose reference keeps all limits.
    fn fastest(
        &self,
        kind: StagedKind,
        options: &StagedOptions,
    ) -> Result<Trajectory<f64>, ExciteError> {
        let b = self.bounds[self.moving];
        let (distance, acceleration) = (self.distance, self.acceleration());
        // A margin need not be kept to the last bit of single precision, but a limit must be.
        let rounding = match options.margin {
            Some(margin) if margin > 0.0 => 1e-6 * (b.high - b.low),
            _ => 0.0,
        };
        let limits = Limits {
            position_low: b.low - rounding,
            position_high: b.high + rounding,
            velocity: b.velocity,
            acceleration: b.acceleration.unwrap_or(f64::MAX),
            ..Limits::default()
        };
        let stated = options.speed_share.is_some();
        let mut factor = if stated { 1.0 } else { SHARE };
        let mut why = String::new();
        for _ in 0..ATTEMPTS {
            let allowance = Allowance {
                distance,
                velocity: factor * b.velocity,
                acceleration: factor * acceleration,
                asked: options,
            };
            factor *= SLOWER;
            let built = allowance.build(kind).map_err(|reason| why = reason);
            let Ok(trajectory) = built else { continue };
            // In single precision, as on the rig.
            let checked: Result<Extremes<f64>, _> = trajectory
                .to_f32()
                .to_f64()
                .check(&limits, self.start[self.moving]);
            if let Err(error) = checked {
                why = error.to_string();
                continue;
            }
            let joints = joints_of(self.robot, self.moving, &self.start, &trajectory);
            let overloaded = self.overloaded(
                &Instants::of_joints(&joints, TORQUE_STEPS),
                &Instants::of_joints(&joints, MOTOR_STEPS),
            )?;
            if let Some(reason) = overloaded {
                why = reason;
                continue;
            }
            return Ok(trajectory);
        }
        Err(self.no_room(why))
    }
}

/// Builds the file for one moving joint and others at rest.
fn file_of(
    robot: &Robot,
    moving: usize,
    start: &[f64],
    trajectory: &Trajectory<f64>,
) -> TrajectoryFile {
    TrajectoryFile {
        robot: robot.name.clone(),
        design: None,
        drive_off: None,
        joints: joints_of(robot, moving, start, trajectory),
    }
}

/// Returns the motions of one moving joint and of others at rest.
fn joints_of(
    robot: &Robot,
    moving: usize,
    start: &[f64],
    trajectory: &Trajectory<f64>,
) -> Vec<JointTrajectory> {
    let hold = trajectory.duration_micros().min(u64::from(u32::MAX)) as u32;
    robot
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
        .collect()
}
