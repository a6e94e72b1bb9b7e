//! Motions that tell the parameters of a robot apart.
//!
//! [`design`] finds Fourier series (Swevers et al. 1997) that are optimal for the base parameters within the limits
//! on position, velocity, acceleration and torque; [`staged`] makes chirps, staircases, slow reversals and friction
//! sweeps from the same limits; [`TrajectoryFile`] keeps either; [`replay`] runs one through the simulated closed
//! loop.
//!
//! # Scaling
//! The columns of the regressor have different units, so that its condition number means nothing by itself. Each
//! column is divided by its own size: its root mean square over states drawn evenly from within the limits (each
//! joint's rows first divided by its torque limit where there are several joints with one). A singular value is then
//! how well a combination of parameters is excited, relative to what the limits would let any motion do for a column
//! alone. No prior value of a parameter enters, so that an offset expected to be zero counts as much as any other.
//!
//! Leaves out: Cartesian limits; collisions; [`crate::robot::Robot::effects`]; errors of the controller (the limits
//! hold for the reference).

mod certificate;
mod error;
mod interval;
mod optimise;
mod problem;
mod replay;
mod stages;
mod trajectory_file;

#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rig_shared::dual::Dual;
use rig_shared::multibody::{COLUMNS, Chain, differential_regressor};
use rig_shared::trajectory::HARMONICS;

use crate::identify::{Base, ModelKind};
use crate::robot::Robot;
use crate::simulate::Model;

pub use certificate::Reach;
pub use error::ExciteError;
pub use replay::{Noise, Replay, replay};
pub use stages::{StagedKind, staged};
pub use trajectory_file::{
    DesignRecord, JointTrajectory, SampledReference, TrajectoryFile, load_reference,
};

use certificate::reach;
use interval::Interval;
use optimise::{WEIGHTS, minimise};
use problem::{Bounds, Frame, JointMotion, Problem, Schedule};

/// States from which the size of a column is estimated; it serves as a unit and need not be precise.
const SIZE_STATES: usize = 4000;
/// Seed of these states and of those that find the base parameters: not the user's, so that values of different
/// seeds compare.
const SIZE_SEED: u64 = 1;
/// Iterations of the optimiser between two updates of its multipliers.
const ITERATIONS: usize = 60;
/// Samples per period of the fastest harmonic from which the reported values are computed.
const REPORT_SAMPLES: usize = 200;
/// Kept free of every limit, so that a trajectory rounded to single precision still fits.
const ROUNDING: f64 = 1e-6;
/// Attempts to shrink a motion until the proof succeeds; each takes away at least 0.1 %.
const SHRINKS: usize = 100;

/// What makes a motion good.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// Small ratio of largest to smallest singular value: errors spread evenly (Gautier & Khalil 1992).
    #[default]
    ConditionNumber,
    /// Large smallest singular value: the worst combination of parameters is known as well as possible.
    SmallestSingularValue,
    /// Large determinant of the information matrix (D-optimal): the confidence ellipsoid is small.
    Determinant,
}

impl Criterion {
    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::ConditionNumber => "cond",
            Self::SmallestSingularValue => "min-singular",
            Self::Determinant => "d-optimal",
        }
    }

    /// The criterion of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [
            Self::ConditionNumber,
            Self::SmallestSingularValue,
            Self::Determinant,
        ]
        .into_iter()
        .find(|c| c.name() == name)
    }

    /// Its value in those of a motion: smaller is better for the condition number, larger for the others.
    pub fn of(self, values: &Values) -> f64 {
        match self {
            Self::ConditionNumber => values.condition_number,
            Self::SmallestSingularValue => values.smallest_singular_value,
            Self::Determinant => values.mean_singular_value,
        }
    }

    fn cost(self, values: &Values) -> f64 {
        match self {
            Self::ConditionNumber => values.condition_number,
            Self::SmallestSingularValue | Self::Determinant => -self.of(values),
        }
    }
}

/// Settings of a design.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// What is optimised.
    pub criterion: Criterion,
    /// Harmonics per joint, 1 to [`HARMONICS`].
    pub harmonics: usize,
    /// Period of the fundamental, s; chosen from the limits where absent, see [`default_period`].
    pub period: Option<f64>,
    /// Whole periods at full amplitude.
    pub periods: u16,
    /// Length of the ramp before and after them, s; one period where absent.
    pub ramp: Option<f64>,
    /// Where the joints start, rad or m; free where absent.
    pub start: Option<Vec<f64>>,
    /// Random starts of the optimiser.
    pub starts: u32,
    /// Seed of them.
    pub seed: u64,
    /// Threads; as many as the machine offers where absent. The result does not depend on it.
    pub threads: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            criterion: Criterion::default(),
            harmonics: 5,
            period: None,
            periods: 5,
            ramp: None,
            start: None,
            starts: 24,
            seed: 1,
            threads: None,
        }
    }
}

/// How well a motion tells the parameters apart, over one whole period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values {
    /// Condition number of the regressor with columns divided by their sizes (see [`self`]).
    pub condition_number: f64,
    /// Smallest singular value of that regressor over the square root of its number of samples.
    pub smallest_singular_value: f64,
    /// Geometric mean of its singular values likewise: the determinant of the information to the power 1/(2p).
    pub mean_singular_value: f64,
    /// Condition number of the regressor in SI units as it is, as identification prints it.
    pub si_condition_number: f64,
}

/// An optimal motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The motion, ready to be saved and run.
    pub file: TrajectoryFile,
    /// How well it does.
    pub values: Values,
    /// The base parameters that it is optimal for, as a paper prints them.
    pub base_parameters: Vec<String>,
    /// Upper bounds of how far each joint goes.
    pub reach: Vec<Reach>,
    /// Criterion reached from each start that ended within the limits, in order of the starts.
    pub reached: Vec<f64>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// A period whose harmonics can use the limits: the fundamental slow enough to sweep the position range at the
/// velocity limit, and the fastest harmonic no faster than where velocity and acceleration limits meet; the longest
/// over the joints, rounded up to 0.1 s.
pub fn default_period(robot: &Robot, harmonics: usize) -> Result<f64, ExciteError> {
    use core::f64::consts::TAU;
    let mut period = 0.1_f64;
    for bounds in bounds_of(robot)?.0 {
        period = period.max(TAU * 0.5 * (bounds.high - bounds.low) / bounds.velocity);
        if let Some(acceleration) = bounds.acceleration {
            period = period.max(TAU * harmonics as f64 * bounds.velocity / acceleration);
        }
    }
    // Rounding must not lift an exact tenth to the next.
    Ok((period * 10.0 - 1e-9).ceil() / 10.0)
}

/// Limits of all joints, and notes on what they lack.
fn bounds_of(robot: &Robot) -> Result<(Vec<Bounds>, Vec<String>), ExciteError> {
    let mut notes = Vec::new();
    let mut list = Vec::new();
    for joint in &robot.joints {
        let limits = joint.limits.as_ref().ok_or_else(|| ExciteError::NoLimits {
            joint: joint.name.clone(),
        })?;
        let [mut low, mut high] = limits.position;
        if !low.is_finite() || !high.is_finite() {
            (low, high) = (-core::f64::consts::PI, core::f64::consts::PI);
            notes.push(format!(
                "Joint \"{}\" turns endlessly; the motion stays within one turn, -pi to pi.",
                joint.name
            ));
        }
        if limits.acceleration.is_none() {
            notes.push(format!(
                "Joint \"{}\" has no acceleration limit in its [joint.limits]; acceleration is bounded by velocity and harmonics only.",
                joint.name
            ));
        }
        list.push(Bounds {
            low,
            high,
            velocity: limits.velocity,
            acceleration: limits.acceleration,
            torque: limits.torque,
        });
    }
    Ok((list, notes))
}

/// Prior parameters, if every link has its own; else none, with the name of the first joint without.
fn prior(robot: &Robot, model: &Model) -> Result<Vec<[f64; COLUMNS]>, String> {
    match robot.joints.iter().find(|j| j.inertial.is_none()) {
        Some(joint) => Err(joint.name.clone()),
        None => Ok(model.parameters.clone()),
    }
}

/// Root mean square of each base column over states within the limits.
fn column_sizes(
    chain: &Chain<f64>,
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
            q[j] = 0.5 * (b.low + b.high) + symmetric(0.5 * (b.high - b.low));
            qd[j] = symmetric(b.velocity);
            // What the velocity limit lets the fastest harmonic do, where that is less.
            let reachable = b.velocity * fastest;
            qdd[j] = symmetric(b.acceleration.map_or(reachable, |a| a.min(reachable)));
        }
        differential_regressor(chain, &q, &qd, &qdd, &mut out)?;
        for (sum, c) in squares.iter_mut().zip(columns) {
            *sum += (0..n)
                .map(|j| (weights[j] * out[j * width + c]).powi(2))
                .sum::<f64>();
        }
    }
    Ok(squares
        .iter()
        .map(|s| (s / SIZE_STATES as f64).sqrt())
        .collect())
}

/// Singular values of a motion's regressor over one period at `samples` instants.
fn values_of(
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
        for j in 0..n {
            for (c, source) in frame.columns.iter().enumerate() {
                let entry = out[j * width + source];
                plain[(s * n + j, c)] = entry;
                scaled[(s * n + j, c)] = entry * frame.weights[j] / frame.sizes[c];
            }
        }
    }
    let condition = |s: &DVector<f64>| s.max() / s.min();
    let singular = scaled.singular_values();
    let root = (samples as f64).sqrt();
    let logs: f64 = singular.iter().map(|s| (s / root).ln()).sum();
    Ok(Values {
        condition_number: condition(&singular),
        smallest_singular_value: singular.min() / root,
        mean_singular_value: (logs / p as f64).exp(),
        si_condition_number: condition(&plain.singular_values()),
    })
}

/// What keeps a motion from its limits: the joint, the quantity, its value and the limit; none where all is well,
/// else the factor that would repair the worst of them if it were proportional to the amplitude.
fn worst(
    reaches: &[Reach],
    bounds: &[Bounds],
    motions: &[JointMotion],
) -> Option<(f64, usize, &'static str)> {
    let mut worst: Option<(f64, usize, &'static str)> = None;
    for (j, (reach, b)) in reaches.iter().zip(bounds).enumerate() {
        let base = motions[j].base;
        let share = |value: f64, limit: f64| {
            if value > 0.0 {
                limit / value
            } else {
                f64::INFINITY
            }
        };
        let room = [
            (share(reach.position[1] - base, b.high - base), "position"),
            (share(base - reach.position[0], base - b.low), "position"),
            (share(reach.velocity, b.velocity), "velocity"),
            (
                b.acceleration
                    .map_or(f64::INFINITY, |a| share(reach.acceleration, a)),
                "acceleration",
            ),
            (
                match (reach.torque, b.torque) {
                    (Some(value), Some(limit)) => share(value, limit),
                    _ => f64::INFINITY,
                },
                "torque",
            ),
        ];
        for (factor, what) in room {
            let tight = factor * (1.0 - ROUNDING);
            // NaN counts as outside.
            if (tight.is_nan() || tight < 1.0)
                && worst.is_none_or(|(w, _, _)| tight.is_nan() || tight < w)
            {
                worst = Some((tight, j, what));
            }
        }
    }
    worst
}

/// A motion and its proved reach, or the joint and the quantity at fault.
type Fitted = Result<(Vec<JointMotion>, Vec<Reach>), (usize, &'static str)>;

/// A motion scaled down about its start until the proof succeeds; the joint and quantity at fault where it never does.
fn fit_within(
    frame: &Frame,
    enclosing: &Chain<Interval>,
    mut motions: Vec<JointMotion>,
) -> Result<Fitted, ExciteError> {
    let mut blame = (0, "position");
    for _ in 0..SHRINKS {
        let reaches = reach(
            &frame.schedule,
            &motions,
            enclosing,
            frame.parameters.as_deref(),
        )?;
        let Some((factor, joint, what)) = worst(&reaches, &frame.bounds, &motions) else {
            return Ok(Ok((motions, reaches)));
        };
        blame = (joint, what);
        if !factor.is_finite() {
            break;
        }
        // Torque is not proportional to the amplitude: never more than 5 % at once.
        let factor = factor.clamp(0.95, 0.999);
        for motion in &mut motions {
            for c in &mut motion.coefficients {
                *c *= factor;
            }
        }
    }
    Ok(Err(blame))
}

/// A random motion within the kinematic limits.
fn random_start(problem: &mut Problem<'_>, frame: &Frame, seed: u64, index: usize) -> DVector<f64> {
    // One stream a start: the same numbers whichever thread takes it.
    let mut random = rand_pcg::Pcg64::new(u128::from(seed), index as u128);
    let mut x = DVector::zeros(problem.size());
    let block = 1 + 2 * frame.schedule.harmonics;
    for value in x.iter_mut() {
        *value = StandardNormal.sample(&mut random);
    }
    for j in 0..frame.bounds.len() {
        // Within the middle half of the range.
        x[j * block] = random.random::<f64>() - 0.5;
    }
    let mut motions = problem.decode(&x);
    let room = problem.room(&x);
    for motion in &mut motions {
        for c in &mut motion.coefficients {
            *c *= 0.9 * room;
        }
    }
    problem.encode(&motions)
}

/// One motion that passed the proof.
struct Candidate {
    motions: Vec<JointMotion>,
    reaches: Vec<Reach>,
    values: Values,
}

type Outcome = Result<Result<Candidate, (usize, &'static str)>, ExciteError>;

fn run_start(
    frame: &Frame,
    enclosing: &Chain<Interval>,
    seed: u64,
    index: usize,
    done: &mut dyn FnMut(),
) -> Outcome {
    let mut problem = Problem::new(frame);
    let start = random_start(&mut problem, frame, seed, index);
    let x = minimise(&mut problem, start, ITERATIONS, done);
    let motions = problem.decode(&x);
    if motions
        .iter()
        .any(|m| !m.base.is_finite() || m.coefficients.iter().any(|c| !c.is_finite()))
    {
        return Ok(Err((0, "position")));
    }
    match fit_within(frame, enclosing, motions)? {
        Err(blame) => Ok(Err(blame)),
        Ok((motions, reaches)) => {
            let samples = REPORT_SAMPLES * frame.schedule.harmonics;
            let values = values_of(frame, &motions, samples)?;
            Ok(Ok(Candidate {
                motions,
                reaches,
                values,
            }))
        }
    }
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

fn frame_of(robot: &Robot, options: &Options) -> Result<(Frame, Base, Vec<String>), ExciteError> {
    let wrong = |name, value: String, right: String| ExciteError::Option { name, value, right };
    if !(1..=HARMONICS).contains(&options.harmonics) {
        return Err(wrong(
            "number of harmonics",
            options.harmonics.to_string(),
            format!("it must be between 1 and {HARMONICS}"),
        ));
    }
    if options.starts == 0 {
        return Err(wrong(
            "number of starts",
            "0".into(),
            "there must be at least one".into(),
        ));
    }
    if options.periods == 0 {
        return Err(wrong(
            "number of periods",
            "0".into(),
            "there must be at least one".into(),
        ));
    }
    let (bounds, mut notes) = bounds_of(robot)?;
    let period = match options.period {
        Some(period) => period,
        None => default_period(robot, options.harmonics)?,
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
    if let Some(start) = &options.start {
        if start.len() != robot.joints.len() {
            return Err(wrong(
                "start",
                format!("{} numbers", start.len()),
                format!("the robot has {} joints", robot.joints.len()),
            ));
        }
        for ((value, b), joint) in start.iter().zip(&bounds).zip(&robot.joints) {
            if !(b.low < *value && *value < b.high) {
                return Err(wrong(
                    "start",
                    value.to_string(),
                    format!(
                        "joint \"{}\" can move between {} and {}",
                        joint.name, b.low, b.high
                    ),
                ));
            }
        }
    }
    let model = Model::from_robot(robot)?;
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
    for (b, joint) in bounds.iter().zip(&robot.joints) {
        if b.torque.is_none() {
            notes.push(format!(
                "Joint \"{}\" has no torque limit in its [joint.limits], so none was kept.",
                joint.name
            ));
        }
    }
    let base = Base::structural(robot, ModelKind::Differential, SIZE_SEED)?;
    let schedule = Schedule {
        period_us,
        ramp_us,
        periods: options.periods,
        harmonics: options.harmonics,
    };
    // Unlike units only compare where every joint says what it can give.
    let comparable = bounds.len() > 1 && bounds.iter().all(|b| b.torque.is_some());
    let weights: Vec<f64> = bounds
        .iter()
        .map(|b| match b.torque {
            Some(limit) if comparable => 1.0 / limit,
            _ => 1.0,
        })
        .collect();
    let fastest = schedule.omega() * options.harmonics as f64;
    let sizes = column_sizes(&model.chain, &base.columns, &bounds, &weights, fastest)?;
    let frame = Frame {
        dual: Chain::<Dual<f64, 3>>::new(&robot.geometry(), robot.gravity)
            .map_err(crate::simulate::SimulateError::from)?,
        plain: model.chain,
        columns: base.columns.clone(),
        sizes,
        weights,
        parameters,
        bounds,
        schedule,
        fixed: options.start.clone(),
        criterion: options.criterion,
    };
    Ok((frame, base, notes))
}

/// Finds the motion that is best by the criterion within the robot's limits.
///
/// Random starts are refined with exact gradients in parallel threads, proved to stay within the limits at every
/// instant, and compared by what they are then worth; the best is returned. The result depends on robot and options
/// alone, not on the number of threads. `progress` is told how many units of work are done, and of how many.
///
/// # Errors
/// [`ExciteError`]: limits that are missing, options out of range, a robot without a model, or no motion within the
/// limits (the joint and the limit at fault are named).
pub fn design(
    robot: &Robot,
    options: &Options,
    mut progress: impl FnMut(u64, u64),
) -> Result<Design, ExciteError> {
    let (frame, base, notes) = frame_of(robot, options)?;
    let enclosing = Chain::<Interval>::new(&robot.geometry(), robot.gravity)
        .map_err(crate::simulate::SimulateError::from)?;
    let starts = options.starts as usize;
    let threads = options
        .threads
        .or_else(|| std::thread::available_parallelism().ok().map(Into::into))
        .unwrap_or(1)
        .clamp(1, starts);
    let total = (starts * (WEIGHTS.len() + 1)) as u64;
    let next = AtomicUsize::new(0);
    let mut outcomes: Vec<Option<Outcome>> = (0..starts).map(|_| None).collect();
    std::thread::scope(|scope| {
        let (send, receive) = mpsc::channel::<Option<(usize, Outcome)>>();
        for _ in 0..threads {
            let send = send.clone();
            let (next, frame, enclosing) = (&next, &frame, &enclosing);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= starts {
                        return;
                    }
                    // The receiver lives until every sender is gone: sending cannot fail.
                    let outcome = run_start(frame, enclosing, options.seed, index, &mut || {
                        let _ = send.send(None);
                    });
                    let _ = send.send(Some((index, outcome)));
                }
            });
        }
        drop(send);
        for (done, message) in (1_u64..).zip(receive) {
            progress(done, total);
            if let Some((index, outcome)) = message {
                outcomes[index] = Some(outcome);
            }
        }
    });
    let mut best: Option<Candidate> = None;
    let mut reached = Vec::new();
    let mut blame = (0, "position");
    for outcome in outcomes.into_iter().flatten() {
        match outcome? {
            Err(fault) => blame = fault,
            Ok(candidate) => {
                reached.push(options.criterion.of(&candidate.values));
                let cost = |c: &Candidate| options.criterion.cost(&c.values);
                if cost(&candidate).is_finite()
                    && best.as_ref().is_none_or(|b| cost(&candidate) < cost(b))
                {
                    best = Some(candidate);
                }
            }
        }
    }
    let best = best.ok_or_else(|| ExciteError::Infeasible {
        joint: robot.joints[blame.0].name.clone(),
        limit: blame.1,
    })?;
    Ok(Design {
        file: TrajectoryFile {
            robot: robot.name.clone(),
            design: Some(DesignRecord {
                criterion: options.criterion,
                value: options.criterion.of(&best.values),
                condition_number: best.values.condition_number,
                seed: options.seed,
            }),
            joints: robot
                .joints
                .iter()
                .zip(&best.motions)
                .map(|(joint, motion)| JointTrajectory {
                    name: joint.name.clone(),
                    start: motion.base,
                    trajectory: frame.schedule.trajectory(&motion.coefficients),
                })
                .collect(),
        },
        values: best.values,
        base_parameters: (0..base.len()).map(|k| base.expression(k)).collect(),
        reach: best.reaches,
        reached,
        notes,
    })
}
