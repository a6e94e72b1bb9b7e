//! The simulated closed loop of model and controller compared with the recorded motion. Without a described controller,
//! the recorded torques drive the model.

use nalgebra::{DMatrix, DVector};

use super::{Motion, MotionCheck, MotionSeries, Options, ValidateError};
use crate::replay::{of_joints, replayed};
use rig_data::prepare::{LowPass, Recording, Survey, Treatment, first_block};
use rig_data::runs::{Run, runs_of_blocks};
use rig_data::{Block, JUDGED_ROWS, JointColumns, strange_references};
use rig_excite::REPLAY_STEP;
use rig_identify::added_torque;
use rig_model::robot::{Controller, Robot};
use rig_model::simulate::{Inputs, Model, SimulateError, closed_loop, controllers};

/// Number of rows in the parabola that gives the initial state of a stretch.
const FIRST_ROWS: usize = 21;
/// Shortest usable stretch between gaps, rows: in shorter ones the initial state dominates.
const FEWEST_ROWS: usize = 5 * FIRST_ROWS;
/// Initial and largest number of simulation steps per sample.
const SUBSTEPS: [u32; 2] = [4, 64];
/// Change of the motion on halving the step, as a share of the reported error, below which the step is fine enough.
const STEP_SHARE: f64 = 0.01;
/// Largest number of points of a curve for plots.
const SERIES_POINTS: usize = 4000;

/// A stretch without a gap, per joint.
struct Stretch {
    t: Vec<f64>,
    reference: Vec<Vec<f64>>,
    q: Vec<Vec<f64>>,
    tau: Vec<Vec<f64>>,
    added: Vec<Vec<f64>>,
    first_velocity: Vec<Option<f64>>,
}

/// Content of a recording for a simulation.
struct Gathered {
    stretches: Vec<Stretch>,
    /// Per joint, description of the added torque.
    added: Vec<String>,
    short: usize,
}

/// Recorded torques that drive the model without a known closed loop.
struct Replay {
    /// Controllers that correct deviations from the recorded motion.
    controllers: Vec<Controller>,
    /// Their origin, a sentence.
    how: String,
    /// The stretches.
    runs: Vec<Run>,
}

impl Replay {
    /// Builds the replay from stretches; the error states why it is impossible.
    fn of(
        robot: &Robot,
        stretches: &[Stretch],
        rate: f64,
        treatment: &Treatment,
    ) -> Result<Self, String> {
        let filter = LowPass::butterworth(treatment.order, treatment.cutoff, rate);
        let filter = filter.ok_or("The filter of its positions cannot be built.")?;
        let blocks = stretches.iter().map(|stretch| {
            let columns = |j: usize| JointColumns {
                q: stretch.q[j].clone(),
                tau: stretch.tau[j].clone(),
                reference: Some(stretch.reference[j].clone()),
                ..JointColumns::default()
            };
            Ok(Block {
                t: stretch.t.clone(),
                joints: (0..stretch.q.len()).map(columns).collect(),
                ..Block::default()
            })
        });
        let runs = runs_of_blocks(blocks, "", 0, rate, &filter).map_err(|e| e.to_string())?;
        let (controllers, how) = of_joints(robot, robot, &runs);
        match controllers {
            Some(controllers) => Ok(Self {
                controllers,
                how,
                runs,
            }),
            None => Err(how),
        }
    }

    /// Simulates the model over stretch `k`, with the whole torque of its drives.
    fn over(
        &self,
        robot: &Robot,
        model: &Model,
        k: usize,
        substeps: u32,
    ) -> Result<rig_model::simulate::Motion, SimulateError> {
        let run = &self.runs[k];
        let mut motion = replayed(robot, model, &self.controllers, run, substeps)?;
        for (answer, joint) in motion.tau.iter_mut().zip(&run.joints) {
            (answer.iter_mut().zip(&joint.tau)).for_each(|(answer, torque)| *answer += torque);
        }
        Ok(motion)
    }
}

/// Simulates `recording` and compares; `progress` receives the completed share.
pub(super) fn check(
    robot: &Robot,
    model: &Model,
    recording: &dyn Recording,
    survey: &Survey,
    treatment: &Treatment,
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Result<Motion, ValidateError> {
    let not = |why: String| Ok(Motion::NotSimulated { why });
    for joint in &robot.joints {
        if joint
            .controller
            .as_ref()
            .is_some_and(|c| stiffness(c) == 0.0)
        {
            return not(format!(
                "A gain of the controller of joint {} is zero, so it does not follow its reference.",
                joint.name
            ));
        }
    }
    let first = match first_reference(robot, recording)? {
        Ok(first) => first,
        Err(why) => return not(why),
    };
    let (controllers, uncontrolled) = match controllers(robot, model, &first) {
        Ok(found) => found,
        Err(e) => return not(sentence(&e.to_string())),
    };
    let gathered = match gather(robot, &controllers, recording, options.most_samples)? {
        Ok(gathered) => gathered,
        Err(why) => return not(why),
    };
    let samples: usize = gathered.stretches.iter().map(|s| s.t.len()).sum();
    if samples == 0 {
        return not(format!(
            "No stretch between gaps in time has {FEWEST_ROWS} rows, the fewest that are simulated."
        ));
    }
    let period = 1.0 / survey.sample_rate;
    let replay = if uncontrolled.is_empty() {
        None
    } else {
        match Replay::of(robot, &gathered.stretches, survey.sample_rate, treatment) {
            Ok(replay) => Some(replay),
            Err(why) => return not(why),
        }
    };
    let run = |substeps: u32, tell: &mut dyn FnMut(f64)| {
        let mut errors = Accumulated::new(robot.joints.len());
        let mut motions = Vec::with_capacity(gathered.stretches.len());
        let mut before = 0;
        for (s, stretch) in gathered.stretches.iter().enumerate() {
            if let Some(replay) = &replay {
                let motion = replay.over(robot, model, s, substeps)?;
                before += stretch.t.len();
                tell(before as f64 / samples as f64);
                errors.push(stretch, &motion);
                motions.push(motion);
                continue;
            }
            let (q, v) = first_state(stretch, period);
            // The drive's limit acts on its whole torque. So added torque enters before the limit, as a shift of the
            // reference that makes the controller request the same additional torque.
            let reference: Vec<Vec<f64>> = stretch
                .reference
                .iter()
                .zip(&stretch.added)
                .zip(&controllers)
                .map(|((r, a), c)| r.iter().zip(a).map(|(r, a)| r + a / stiffness(c)).collect())
                .collect();
            let motion = closed_loop(
                robot,
                model,
                &controllers,
                &Inputs {
                    period,
                    reference: &reference,
                    feed_forward: &[],
                    added: &[],
                    q: &q,
                    v: &v,
                    substeps,
                    held: true,
                },
                |k| {
                    if k.is_multiple_of(1024) {
                        tell((before + k) as f64 / samples as f64);
                    }
                },
            )?;
            before += stretch.t.len();
            errors.push(stretch, &motion);
            motions.push(motion);
        }
        Ok::<_, SimulateError>((errors, motions))
    };
    let [begin, most] = match replay {
        None => SUBSTEPS,
        // A torque held over a whole sample does not justify sixteen times the work.
        Some(_) => [(period / REPLAY_STEP).ceil().max(1.0) as u32; 2],
    };
    let mut substeps = options.substeps.unwrap_or(begin).max(1);
    let last = options.substeps.unwrap_or(most).max(1);
    // The work doubles from run to run, so the first ones are a small share of it.
    let outcome = (|| {
        let mut coarse = run(substeps, &mut |p| progress(0.3 * p))?;
        loop {
            let fine = run(2 * substeps, &mut |p| progress(0.3 + 0.6 * p))?;
            let change = Change::between(&coarse.1, &fine.1);
            let settled = coarse.0.joints.iter().zip(&change).all(|(e, c)| {
                c.position <= STEP_SHARE * e.position_rms()
                    && c.torque <= STEP_SHARE * e.torque_rms()
            });
            if settled || 2 * substeps > last {
                return Ok::<_, SimulateError>((coarse.0, coarse.1, change, settled));
            }
            coarse = fine;
            substeps *= 2;
        }
    })();
    let (errors, motions, change, settled) = match outcome {
        Ok(outcome) => outcome,
        Err(e) => return not(sentence(&e.to_string())),
    };
    let step = period / f64::from(substeps);
    let mut remarks = vec![
        match &replay {
            Some(replay) => format!(
                "{} Every stretch starts from its own first position and velocity.",
                replay.how
            ),
            None => format!(
                "Every stretch starts from its own first position and velocity (a parabola through its first {FIRST_ROWS} rows, or the recorded velocity). After that only {} the simulation.",
                if gathered.added.is_empty() {
                    "the reference drives"
                } else {
                    "the reference and the added torque drive"
                }
            ),
        },
        if settled {
            format!(
                "Step {:.4} ms ({substeps} a sample); halving it changes the motion by less than {:.0} % of the errors shown.",
                1e3 * step,
                100.0 * STEP_SHARE
            )
        } else {
            format!(
                "Step {:.4} ms ({substeps} a sample); halving it still changes the motion by more than {:.0} % of the errors shown: compare the columns.",
                1e3 * step,
                100.0 * STEP_SHARE
            )
        },
    ];
    if replay.is_none() {
        remarks.extend(gathered.added.iter().cloned());
    }
    remarks.extend(model.effects.unsimulated());
    if gathered.short > 0 {
        remarks.push(format!(
            "{} stretches between gaps in time are shorter than {FEWEST_ROWS} rows and were not simulated.",
            gathered.short
        ));
    }
    if (samples as u64) < survey.rows && samples >= options.most_samples {
        remarks.push(format!(
            "Only the first {samples} of {} samples ({:.1} s) were simulated, to bound memory.",
            survey.rows,
            samples as f64 * period
        ));
    }
    let joints = errors
        .joints
        .iter()
        .zip(&robot.joints)
        .zip(&change)
        .enumerate()
        .map(|(j, ((e, joint), change))| {
            let (position_unit, torque_unit) = joint.kind.units();
            MotionCheck {
                joint: joint.name.clone(),
                position_unit: position_unit.to_owned(),
                torque_unit: torque_unit.to_owned(),
                position_rms_error: e.position_rms(),
                position_max_error: e.position_max,
                position_relative_error: e.position_rms() / e.spread(),
                tracking_rms: e.rms(e.tracking),
                tracking_relative_error: e.position_rms() / e.rms(e.tracking),
                torque_rms_error: e.torque_rms(),
                torque_max_error: e.torque_max,
                torque_relative_error: e.torque_rms() / e.rms(e.torque_squares),
                saturated: motions.iter().map(|m| m.saturated[j] as u64).sum(),
                position_step_change: change.position,
                torque_step_change: change.torque,
                series: series(j, &gathered.stretches, &motions, samples),
            }
        })
        .collect();
    Ok(Motion::Simulated {
        joints,
        samples: samples as u64,
        of: survey.rows,
        stretches: gathered.stretches.len(),
        substeps,
        uncontrolled,
        remarks,
    })
}

/// Returns the controller's torque per position error, N·m/rad or N/m.
fn stiffness(c: &Controller) -> f64 {
    c.torque_gain * c.velocity_gain * c.position_gain
}

/// Turns a message of another crate into a sentence.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map(|c| c.to_uppercase().chain(letters).collect())
        .unwrap_or_default()
}

/// Returns the reference of every joint in the first row, where a substitute controller is designed. The inner error is
/// the sentence on why a motion along the references would not be that of the recording.
fn first_reference(
    robot: &Robot,
    recording: &dyn Recording,
) -> Result<Result<Vec<f64>, String>, ValidateError> {
    Ok(first_block(recording, JUDGED_ROWS)?.map_or_else(
        || Err("The recording has no rows.".to_owned()),
        |block| of_block(robot, &block),
    ))
}

fn no_reference(joint: &str, j: usize) -> String {
    format!(
        "The recording has no reference for joint {joint} (column ref{}).",
        j + 1
    )
}

fn of_block(robot: &Robot, block: &Block) -> Result<Vec<f64>, String> {
    let mut first = Vec::new();
    for (j, (columns, joint)) in block.joints.iter().zip(&robot.joints).enumerate() {
        let value = columns.reference.as_ref().and_then(|r| r.first().copied());
        first.push(value.ok_or_else(|| no_reference(&joint.name, j))?);
    }
    let controlled = |joint: usize| {
        (robot.joints.get(joint.saturating_sub(1))).is_some_and(|j| j.controller.is_some())
    };
    match strange_references(block, robot).into_iter().next() {
        Some(found) if controlled(found.joint()) => Err(format!(
            "A simulated controller cannot follow these references as the robot did: {found}."
        )),
        Some(found) => Err(format!(
            "The description has no [joint.controller], and a stand-in cannot follow these references: {found}."
        )),
        None => Ok(first),
    }
}

/// Reads the input of the simulation; the inner error is a sentence about missing data.
fn gather(
    robot: &Robot,
    controllers: &[Controller],
    recording: &dyn Recording,
    most: usize,
) -> Result<Result<Gathered, String>, ValidateError> {
    let n = robot.joints.len();
    let mut all: Vec<Stretch> = Vec::new();
    let mut seen = 0usize;
    let mut missing: Option<String> = None;
    let mut named: Vec<String> = Vec::new();
    recording.each_block(1 << 16, &mut |block| {
        let room = most.saturating_sub(seen).min(block.len());
        if missing.is_some() || room == 0 {
            return Ok(());
        }
        if let Some(j) = block.joints.iter().position(|j| j.reference.is_none()) {
            missing = Some(no_reference(&robot.joints[j].name, j));
            return Ok(());
        }
        if !block.continues || all.is_empty() {
            all.push(Stretch {
                t: Vec::new(),
                reference: vec![Vec::new(); n],
                q: vec![Vec::new(); n],
                tau: vec![Vec::new(); n],
                added: vec![Vec::new(); n],
                first_velocity: block
                    .joints
                    .iter()
                    .map(|j| j.qd.as_ref().and_then(|v| v.first().copied()))
                    .collect(),
            });
        }
        let Some(stretch) = all.last_mut() else {
            return Ok(());
        };
        stretch.t.extend(&block.t[..room]);
        for (j, joint) in block.joints.iter().enumerate() {
            stretch.q[j].extend(&joint.q[..room]);
            stretch.tau[j].extend(&joint.tau[..room]);
            if let Some(reference) = &joint.reference {
                stretch.reference[j].extend(&reference[..room]);
            }
            let added = added_torque(&block, j, controllers, room, &mut named);
            if added.iter().any(|a| a.is_nan()) {
                missing = Some(format!(
                    "The torque added to joint {} is not a number in some rows.",
                    robot.joints[j].name
                ));
            }
            stretch.added[j].extend(added);
        }
        seen += room;
        Ok(())
    })?;
    if let Some(why) = missing {
        return Ok(Err(why));
    }
    let before = all.len();
    all.retain(|s| s.t.len() >= FEWEST_ROWS);
    Ok(Ok(Gathered {
        short: before - all.len(),
        stretches: all,
        added: named,
    }))
}

/// Returns position and velocity at the first row of a stretch.
fn first_state(stretch: &Stretch, period: f64) -> (Vec<f64>, Vec<f64>) {
    let n = stretch.q.len();
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    let rows = FIRST_ROWS.min(stretch.t.len());
    let a = DMatrix::from_fn(rows, 3, |i, power| (i as f64).powi(power as i32));
    let svd = a.svd(true, true);
    for j in 0..n {
        let y = DVector::from_fn(rows, |i, _| stretch.q[j][i]);
        // A parabola over distinct instants always has a solution; the first row is the fallback.
        let (position, slope) = svd
            .solve(&y, 1e-12)
            .map_or((stretch.q[j][0], 0.0), |x| (x[0], x[1] / period));
        q[j] = position;
        v[j] = stretch.first_velocity[j].unwrap_or(slope);
    }
    (q, v)
}

/// Sums over the samples of one joint.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    n: f64,
    position: f64,
    position_max: f64,
    torque: f64,
    torque_max: f64,
    torque_squares: f64,
    tracking: f64,
    // Relative to the first sample, so that a large mean position loses no digits.
    origin: f64,
    first: f64,
    second: f64,
}

impl Sums {
    fn rms(&self, squares: f64) -> f64 {
        (squares / self.n.max(1.0)).sqrt()
    }
    fn position_rms(&self) -> f64 {
        self.rms(self.position)
    }
    fn torque_rms(&self) -> f64 {
        self.rms(self.torque)
    }
    fn spread(&self) -> f64 {
        let n = self.n.max(1.0);
        (self.second / n - (self.first / n).powi(2)).max(0.0).sqrt()
    }
}

struct Accumulated {
    joints: Vec<Sums>,
}

impl Accumulated {
    fn new(joints: usize) -> Self {
        Self {
            joints: vec![Sums::default(); joints],
        }
    }

    fn push(&mut self, stretch: &Stretch, motion: &rig_model::simulate::Motion) {
        for (j, s) in self.joints.iter_mut().enumerate() {
            for k in 0..motion.q[j].len() {
                let q = stretch.q[j][k];
                if s.n == 0.0 {
                    s.origin = q;
                }
                let e = motion.q[j][k] - q;
                let tau = motion.tau[j][k] - stretch.tau[j][k];
                s.n += 1.0;
                s.position += e * e;
                s.position_max = s.position_max.max(e.abs());
                s.torque += tau * tau;
                s.torque_max = s.torque_max.max(tau.abs());
                s.torque_squares += stretch.tau[j][k].powi(2);
                s.tracking += (stretch.reference[j][k] - q).powi(2);
                s.first += q - s.origin;
                s.second += (q - s.origin).powi(2);
            }
        }
    }
}

/// RMS differences between two runs of one joint.
struct Change {
    position: f64,
    torque: f64,
}

impl Change {
    fn between(a: &[rig_model::simulate::Motion], b: &[rig_model::simulate::Motion]) -> Vec<Self> {
        let joints = a.first().map_or(0, |m| m.q.len());
        let rms = |of: &dyn Fn(&rig_model::simulate::Motion) -> &[f64]| {
            let (mut n, mut sum) = (0.0f64, 0.0);
            for (a, b) in a.iter().zip(b) {
                for (x, y) in of(a).iter().zip(of(b)) {
                    n += 1.0;
                    sum += (x - y).powi(2);
                }
            }
            (sum / n.max(1.0)).sqrt()
        };
        (0..joints)
            .map(|j| Self {
                position: rms(&|m| &m.q[j]),
                torque: rms(&|m| &m.tau[j]),
            })
            .collect()
    }
}

fn series(
    j: usize,
    stretches: &[Stretch],
    motions: &[rig_model::simulate::Motion],
    samples: usize,
) -> MotionSeries {
    let every = samples.div_ceil(SERIES_POINTS).max(1);
    let mut series = MotionSeries::default();
    for (stretch, motion) in stretches.iter().zip(motions) {
        for k in (0..stretch.t.len()).step_by(every) {
            series.t.push(stretch.t[k]);
            series.reference.push(stretch.reference[j][k]);
            series.measured.push(stretch.q[j][k]);
            series.simulated.push(motion.q[j][k]);
            series.torque_measured.push(stretch.tau[j][k]);
            series.torque_simulated.push(motion.tau[j][k]);
        }
    }
    series
}
