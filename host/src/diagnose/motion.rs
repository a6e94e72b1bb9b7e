//! What each model makes of the motion: the recorded torques drive it, and each joint's controller answers where it departs
//! from the recorded motion.
//!
//! A joint's controller that is linear in position and velocity gives, for the motion q of a model instead of the recorded
//! q_m, its recorded torque and kp·(q_m − q) + kd·(q̇_m − q̇): whatever it feeds forward is in the recorded torque
//! already. So the closed loop is simulated without knowing more of it than kp and kd. They are those of [joint.controller]
//! where the description has one, else regressed from the recording where a reference stands in it and explains the
//! torque, else those of a slow stand-in, with which a joint that would fall or drift stays at the recorded motion.
//!
//! Leaves out: integral action (part of the recorded torque), controllers that couple joints, temperatures, what acts on the
//! voltage.

use rig_shared::multibody::column;

use super::DiagnoseError;
use super::bench::Loaded;
use super::bodies::Fitting;
use super::floor;
use super::profile::Profile;
use super::pull;
use super::runs::{JointRun, Run};
use crate::robot::{Controller, Placed, Robot, title_of};
use crate::simulate::{Inputs, Model, Motion, SimulateError, Since, closed_loop_since};

mod controller;

pub(crate) use controller::of_joints;

/// Longest step, s.
const STEP: f64 = 1.0e-3;
/// Departures a second: the positions that joints depart by are smooth.
const DEPARTURES: f64 = 100.0;
/// Length of the blocks that are compared, s.
const BLOCK: f64 = 1.0;
/// A motion is worse when its RMS grows by more than this share …
const WORSE: f64 = 0.02;
/// … and its squares by more than so many standard deviations of their change from block to block.
const SIGMAS: f64 = 3.0;

/// Positions, joint by joint.
pub(super) type Positions = Vec<Vec<f64>>;

/// Errors of the simulated motion, joint by joint and block by block: sum of squares and rows.
pub(super) struct Errors(Vec<Vec<[f64; 2]>>);

impl Errors {
    /// Of a joint, rad or m.
    pub(super) fn rms(&self, joint: usize) -> f64 {
        let [sum, rows] = (self.0[joint].iter()).fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        (sum / f64::max(rows, 1.0)).sqrt()
    }

    /// Whether those of a joint are larger than `before` by more than noise makes them.
    pub(super) fn worse_than(&self, before: &Self, joint: usize) -> bool {
        let changes: Vec<f64> = (self.0[joint].iter().zip(&before.0[joint]))
            .map(|(a, b)| a[0] - b[0])
            .collect();
        let n = changes.len() as f64;
        let mean = changes.iter().sum::<f64>() / n;
        let spread: f64 = changes.iter().map(|c| (c - mean).powi(2)).sum();
        let std = (spread / (n * (n - 1.0))).sqrt();
        self.rms(joint) > (1.0 + WORSE) * before.rms(joint) && mean > SIGMAS * std
    }
}

/// By how much the simulated positions of a single joint depart from those recorded, rad or m, a hundred times a second.
pub(super) struct Departures {
    pub(super) of: Vec<f64>,
    /// Motion and stretch of it, a second long; runs of one motion share theirs.
    pub(super) stretch: Vec<(usize, usize)>,
}

/// Recordings to be simulated.
pub(super) struct Replay<'a> {
    fitting: &'a Fitting<'a, 'a>,
    /// What models are judged on.
    pub(super) judged: &'a Loaded,
    runs: &'a [Run],
    /// One a joint; none where nothing is simulated.
    controllers: Option<Vec<Controller>>,
    /// Which controllers, or why nothing is simulated, a sentence.
    how: String,
}

impl<'a> Replay<'a> {
    /// Of the recordings that models are judged on.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn of(
        fitting: &'a Fitting<'a, 'a>,
        judged: &'a Loaded,
    ) -> Result<Self, DiagnoseError> {
        let moving = fitting.of(&[])?;
        let (controllers, how) = of_joints(fitting.bench.robot, &moving.model, &judged.runs);
        Ok(Self {
            fitting,
            judged,
            runs: &judged.runs,
            controllers,
            how,
        })
    }

    /// Positions of a model, run by run; the error says why there are none.
    fn simulated(&self, robot: &Robot) -> Result<Vec<Positions>, String> {
        let Some(controllers) = &self.controllers else {
            return Err(self.how.clone());
        };
        let mut alone = robot.clone();
        (alone.effects).retain(|e| !pull::is_outside(e.effect.kind));
        let of = |robot: &Robot| Model::from_robot(robot).map_err(|e| e.to_string());
        let (model, unburdened) = (of(robot)?, of(&alone)?);
        if let Some(what) = model.effects.unsimulated().into_iter().next() {
            return Err(what);
        }
        let one = |run: &Run| {
            let (robot, model) = match run.unburdened {
                true => (&alone, &unburdened),
                false => (robot, &model),
            };
            let substeps = (1.0 / run.rate / STEP).ceil().max(1.0) as u32;
            Ok(replayed(robot, model, controllers, run, substeps)?.q)
        };
        let all: Result<_, SimulateError> = self.runs.iter().map(one).collect();
        all.map_err(|e| e.to_string())
    }

    /// How the motion was simulated, and why not from the first model on that could not be, sentences. The first `described`
    /// effects are the description's.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn told(
        &self,
        chosen: &[Profile],
        described: usize,
    ) -> Result<String, DiagnoseError> {
        if self.controllers.is_none() {
            return Ok(self.how.clone());
        }
        for count in described..=chosen.len() {
            if let Err(why) = self.simulated(&self.fitting.of(&chosen[..count])?.model) {
                let whose = match count.checked_sub(1).map(|k| chosen[k].candidate.kind) {
                    Some(kind) => format!("The model with {} among its effects", title_of(kind)),
                    None => "The model without effects".to_owned(),
                };
                return Ok(format!("{} {whose} was not simulated: {why}", self.how));
            }
        }
        Ok(self.how.clone())
    }

    /// What a description's motion is off by; none where it cannot be simulated.
    pub(super) fn errors_of(&self, robot: &Robot) -> Option<Errors> {
        let simulated = self.simulated(robot).ok()?;
        let joints = 0..robot.joints.len();
        let of_joint = |joint: usize| -> Vec<[f64; 2]> {
            let mut blocks = Vec::new();
            for (run, q) in self.runs.iter().zip(&simulated) {
                let rows = ((BLOCK * run.rate).round() as usize).max(1);
                let errors = (q[joint].iter().zip(&run.joints[joint].q)).map(|(a, b)| a - b);
                let squares: Vec<f64> = errors.map(|e| e * e).collect();
                let sums = squares
                    .chunks(rows)
                    .map(|c| [c.iter().sum(), c.len() as f64]);
                blocks.extend(sums);
            }
            blocks
        };
        Some(Errors(joints.map(of_joint).collect()))
    }

    /// What a description of one joint departs by; none where it cannot be simulated.
    pub(super) fn departures(&self, robot: &Robot) -> Option<Departures> {
        let simulated = self.simulated(robot).ok()?;
        let repeats = floor::repeats(self.runs);
        let mut found = Departures {
            of: Vec::new(),
            stretch: Vec::new(),
        };
        for (r, (run, q)) in self.runs.iter().zip(&simulated).enumerate() {
            let first = (repeats.iter().filter(|(_, b)| *b == r))
                .map(|(a, _)| *a)
                .min();
            let step = ((run.rate / DEPARTURES).round() as usize).max(1);
            let errors = q[0].iter().zip(&run.joints[0].q).map(|(a, b)| a - b);
            for (k, error) in errors.enumerate().step_by(step) {
                found.of.push(error);
                let stretch = (k as f64 / run.rate / BLOCK) as usize;
                found.stretch.push((first.unwrap_or(r), stretch));
            }
        }
        Some(found)
    }

    /// The same of the model with `chosen`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn errors(&self, chosen: &[Profile]) -> Result<Option<Errors>, DiagnoseError> {
        if self.controllers.is_none() {
            return Ok(None);
        }
        Ok(self.errors_of(&self.fitting.of(chosen)?.model))
    }

    /// Simulated positions with the `described` first and with all of `chosen`, run by run; empty where they cannot be
    /// simulated.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn drawn(
        &self,
        chosen: &[Profile],
        described: usize,
    ) -> Result<[Vec<Positions>; 2], DiagnoseError> {
        if self.controllers.is_none() {
            return Ok(Default::default());
        }
        let of = |part: &[Profile]| -> Result<_, DiagnoseError> {
            Ok(self
                .simulated(&self.fitting.of(part)?.model)
                .unwrap_or_default())
        };
        Ok([
            of(&chosen[..described])?,
            if chosen.len() == described {
                Vec::new()
            } else {
                of(chosen)?
            },
        ])
    }

    /// The first effect beyond the `described` first that makes the motion of its joint worse where it came in, and among all as far as
    /// these can be simulated. Worse by more than a share of `most` counts whatever it differs by between stretches.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn spoiling(
        &self,
        chosen: &[Profile],
        described: usize,
        most: f64,
    ) -> Result<Option<usize>, DiagnoseError> {
        let mut before = self.errors(&chosen[..described])?;
        for k in described..chosen.len() {
            let after = self.errors(&chosen[..=k])?;
            let joint = chosen[k].candidate.joint;
            let worse = |[a, b]: [&Option<Errors>; 2]| match (a, b) {
                (Some(a), Some(b)) => {
                    Some(a.worse_than(b, joint) || a.rms(joint) > (1.0 + most) * b.rms(joint))
                }
                _ => None,
            };
            if worse([&after, &before]) == Some(true) {
                let mut others = chosen.to_vec();
                others.remove(k);
                let [all, without] = [chosen, &others].map(|list| self.errors(list));
                if worse([&all?, &without?]) != Some(false) {
                    return Ok(Some(k));
                }
            }
            before = after;
        }
        Ok(None)
    }
}

/// Motion of `model` under the torques of a run and the controllers' answers to what it departs by, which alone its torques are;
/// `substeps` within a sample.
///
/// # Errors
/// Those of [`crate::simulate::closed_loop`].
pub(crate) fn replayed(
    robot: &Robot,
    model: &Model,
    controllers: &[Controller],
    run: &Run,
    substeps: u32,
) -> Result<Motion, SimulateError> {
    if run.is_empty() {
        let none = || vec![Vec::new(); run.joints.len()];
        return Ok(Motion {
            q: none(),
            qd: none(),
            tau: none(),
            saturated: vec![0; run.joints.len()],
        });
    }
    let period = 1.0 / run.rate;
    let added: Vec<Vec<f64>> = (run.joints.iter().enumerate())
        .map(|(j, joint)| {
            let applied = model.effects.applied_effort(j, &joint.tau, period);
            // A torque held over a sample acts as in its middle.
            (0..applied.len())
                .map(|k| 0.5 * (applied[k] + applied[(k + 1).min(applied.len() - 1)]))
                .collect()
        })
        .collect();
    let reference: Vec<Vec<f64>> = (run.joints.iter().zip(controllers))
        .map(|(joint, controller)| {
            let ahead = joint.qd.iter().map(|v| v / controller.position_gain);
            joint.q.iter().zip(ahead).map(|(q, a)| q + a).collect()
        })
        .collect();
    let first = |of: fn(&JointRun) -> &[f64]| -> Vec<f64> {
        run.joints.iter().map(|joint| of(joint)[0]).collect()
    };
    let remembered = |p: &Placed| {
        let row = &model.parameters[p.joint];
        let friction = [row[column::VISCOUS], row[column::COULOMB]];
        run.past.remembered(&p.effect, p.joint, friction)
    };
    let since = Since {
        time: run.t[0] - run.began,
        memory: model.effects.placed().iter().map(remembered).collect(),
    };
    closed_loop_since(
        robot,
        model,
        controllers,
        &Inputs {
            period,
            reference: &reference,
            feed_forward: &[],
            added: &added,
            q: &first(|joint| &joint.q),
            v: &first(|joint| &joint.qd),
            substeps,
            held: true,
        },
        &since,
        |_| (),
    )
}

#[cfg(test)]
mod tests;
