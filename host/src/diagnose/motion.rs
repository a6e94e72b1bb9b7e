//! What each model makes of the motion: the recorded torque drives it, and a controller answers where it departs from the
//! recorded motion.
//!
//! A joint's controller that is linear in position and velocity gives, for the motion q of a model instead of the recorded
//! q_m, its recorded torque and kp·(q_m − q) + kd·(q̇_m − q̇): whatever it feeds forward is in the recorded torque
//! already. So the closed loop is simulated without knowing more of it than kp and kd. They are those of [joint.controller]
//! where the description has one, else regressed from the recording where a reference stands in it and explains the
//! torque, else those of a slow stand-in, with which a joint that would fall or drift stays at the recorded motion.
//!
//! Leaves out: integral action (part of the recorded torque), several joints, temperatures, what acts on the voltage.

use nalgebra::{DMatrix, DVector};

use super::DiagnoseError;
use super::bench::{Bench, Loaded};
use super::model::with_effects;
use super::profile::Profile;
use super::pull;
use super::refit::Refit;
use super::runs::Run;
use crate::robot::{Controller, Robot, title_of};
use crate::simulate::{Inputs, Model, SimulateError, closed_loop, controllers};

/// Longest step, s.
const STEP: f64 = 1.0e-3;
/// Length of the blocks that are compared, s.
const BLOCK: f64 = 1.0;
/// Share of the torque's power that a controller and what it feeds forward have to explain.
const EXPLAINED: f64 = 0.98;
/// Rows at most that it is regressed from.
const ROWS: usize = 20_000;
/// What the torque is regressed on: position and velocity error, integral of the former, velocity and acceleration of the
/// reference, its sine and cosine (a weight fed forward), a constant.
const COLUMNS: usize = 8;
/// Controllers that are tried, by their columns, the simplest first: where a motion has few frequencies, many columns say the
/// same. With the reference's velocity beside the velocity error, feedback of the velocity alone is among them.
const SETS: [&[usize]; 4] = [
    &[0, 1, 7],
    &[0, 1, 3, 7],
    &[0, 1, 3, 4, 5, 6, 7],
    &[0, 1, 2, 3, 4, 5, 6, 7],
];
/// A motion is worse when its RMS grows by more than this share …
const WORSE: f64 = 0.02;
/// … and its squares by more than so many standard deviations of their change from block to block.
const SIGMAS: f64 = 3.0;

/// Errors of the simulated motion, block by block: sum of squares and rows.
pub(super) struct Errors(Vec<[f64; 2]>);

impl Errors {
    /// rad or m
    pub(super) fn rms(&self) -> f64 {
        let [sum, rows] = (self.0.iter()).fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        (sum / f64::max(rows, 1.0)).sqrt()
    }

    /// Whether they are larger than `before` by more than noise makes them.
    fn worse_than(&self, before: &Self) -> bool {
        let changes: Vec<f64> = (self.0.iter().zip(&before.0))
            .map(|(a, b)| a[0] - b[0])
            .collect();
        let n = changes.len() as f64;
        let mean = changes.iter().sum::<f64>() / n;
        let spread: f64 = changes.iter().map(|c| (c - mean).powi(2)).sum();
        let std = (spread / (n * (n - 1.0))).sqrt();
        self.rms() > (1.0 + WORSE) * before.rms() && mean > SIGMAS * std
    }
}

/// Recordings to be simulated.
pub(super) struct Replay<'a> {
    bench: &'a Bench<'a>,
    refit: &'a Refit<'a>,
    /// Base parameters that the effects' columns are formed with.
    formed_at: &'a [f64],
    runs: &'a [Run],
    controller: Option<Controller>,
    /// Which controller, or why nothing is simulated, a sentence.
    how: String,
}

impl<'a> Replay<'a> {
    /// Of the recordings that models are judged on.
    pub(super) fn of(
        bench: &'a Bench<'a>,
        refit: &'a Refit<'a>,
        formed_at: &'a [f64],
        judged: &'a Loaded,
    ) -> Self {
        let (controller, how) = match bench.robot.joints.as_slice() {
            [joint] => {
                let unit = joint.kind.units();
                let with = |c: &Controller, from: &str| {
                    let kd = c.torque_gain * c.velocity_gain;
                    format!(
                        "The recorded torque drives each model, and a controller answers what it departs from the recorded motion by: {from} ({:.3} {}/{} and {:.3} {}·s/{}).",
                        kd * c.position_gain,
                        unit.1,
                        unit.0,
                        kd,
                        unit.1,
                        unit.0
                    )
                };
                let loops =
                    |c: &Controller| c.torque_gain * c.velocity_gain * c.position_gain > 0.0;
                match (
                    joint.controller.clone().filter(loops),
                    regressed(&judged.runs),
                ) {
                    (Some(c), _) => (Some(c.clone()), with(&c, "the description's own")),
                    (None, Some(c)) => (
                        Some(c.clone()),
                        with(&c, "the one that the references in the recordings show"),
                    ),
                    (None, None) => match stand_in(bench.robot, &judged.runs) {
                        Ok(c) => (
                            Some(c.clone()),
                            with(&c, "a stand-in of 5 Hz, as the recordings show none"),
                        ),
                        Err(error) => (None, format!("The motion was not simulated: {error}")),
                    },
                }
            }
            _ => (
                None,
                "The motion was not simulated: that is done for a robot of one joint.".to_owned(),
            ),
        };
        Self {
            bench,
            refit,
            formed_at,
            runs: &judged.runs,
            controller,
            how,
        }
    }

    /// The description with effects, its parameters fitted with them.
    fn model(&self, chosen: &[Profile]) -> Result<Robot, DiagnoseError> {
        let values = self.refit.solution(chosen)?.values;
        let Bench {
            robot,
            nominal,
            anchor,
            ..
        } = self.bench;
        Ok(with_effects(robot, nominal, anchor, &values, self.formed_at, chosen).0)
    }

    /// Positions of the model with `chosen`, run by run; the inner error says why there are none.
    fn simulated(&self, robot: &Robot) -> Result<Vec<Vec<f64>>, String> {
        let Some(controller) = &self.controller else {
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
            if run.unburdened {
                replayed(&alone, &unburdened, controller, run)
            } else {
                replayed(robot, &model, controller, run)
            }
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
        if self.controller.is_none() {
            return Ok(self.how.clone());
        }
        for count in described..=chosen.len() {
            if let Err(why) = self.simulated(&self.model(&chosen[..count])?) {
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
        let mut blocks = Vec::new();
        for (run, q) in self.runs.iter().zip(&simulated) {
            let rows = ((BLOCK * run.rate).round() as usize).max(1);
            let errors = (q.iter().zip(&run.joints[0].q)).map(|(a, b)| a - b);
            let squares: Vec<f64> = errors.map(|e| e * e).collect();
            blocks.extend(
                squares
                    .chunks(rows)
                    .map(|c| [c.iter().sum(), c.len() as f64]),
            );
        }
        Some(Errors(blocks))
    }

    /// The same of the model with `chosen`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn errors(&self, chosen: &[Profile]) -> Result<Option<Errors>, DiagnoseError> {
        if self.controller.is_none() {
            return Ok(None);
        }
        Ok(self.errors_of(&self.model(chosen)?))
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
    ) -> Result<[Vec<Vec<f64>>; 2], DiagnoseError> {
        if self.controller.is_none() {
            return Ok(Default::default());
        }
        let of = |part: &[Profile]| -> Result<_, DiagnoseError> {
            Ok(self.simulated(&self.model(part)?).unwrap_or_default())
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

    /// The first effect beyond the `described` first that makes the motion worse where it came in, and among all as far as
    /// these can be simulated.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn spoiling(
        &self,
        chosen: &[Profile],
        described: usize,
    ) -> Result<Option<usize>, DiagnoseError> {
        let mut before = self.errors(&chosen[..described])?;
        for k in described..chosen.len() {
            let after = self.errors(&chosen[..=k])?;
            let worse = |[a, b]: [&Option<Errors>; 2]| match (a, b) {
                (Some(a), Some(b)) => Some(a.worse_than(b)),
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

/// Positions of `model` under the torque of a run and the controller's answer to what it departs by.
fn replayed(
    robot: &Robot,
    model: &Model,
    controller: &Controller,
    run: &Run,
) -> Result<Vec<f64>, SimulateError> {
    let joint = &run.joints[0];
    let (Some(q), Some(v)) = (joint.q.first(), joint.qd.first()) else {
        return Ok(Vec::new());
    };
    let period = 1.0 / run.rate;
    let applied = model.effects.applied_effort(0, &joint.tau, period);
    // A torque held over a sample acts as in its middle.
    let added: Vec<f64> = (0..applied.len())
        .map(|k| 0.5 * (applied[k] + applied[(k + 1).min(applied.len() - 1)]))
        .collect();
    let reference = (joint.q.iter().zip(&joint.qd))
        .map(|(q, v)| q + v / controller.position_gain)
        .collect();
    let mut motion = closed_loop(
        robot,
        model,
        std::slice::from_ref(controller),
        &Inputs {
            period,
            reference: &[reference],
            added: &[added],
            q: &[*q],
            v: &[*v],
            substeps: (period / STEP).ceil().max(1.0) as u32,
        },
        |_| (),
    )?;
    Ok(std::mem::take(&mut motion.q[0]))
}

/// The slow controller for what the description says moves.
fn stand_in(robot: &Robot, runs: &[Run]) -> Result<Controller, SimulateError> {
    let model = Model::from_robot(robot)?;
    let start = runs.iter().find_map(|run| run.joints[0].q.first().copied());
    let (list, _) = controllers(robot, &model, &[start.unwrap_or(0.0)])?;
    // One joint has one controller.
    list.into_iter()
        .next()
        .ok_or(SimulateError::NotPositiveDefinite { joint: 1 })
}

/// The controller that the references and torques of the runs show; none where there are none, or they do not.
fn regressed(runs: &[Run]) -> Option<Controller> {
    let every = runs
        .iter()
        .map(Run::len)
        .sum::<usize>()
        .div_ceil(ROWS)
        .max(1);
    let mut normal = DMatrix::<f64>::zeros(COLUMNS, COLUMNS);
    let mut right = DVector::<f64>::zeros(COLUMNS);
    let (mut power, mut mean, mut count) = (0.0, 0.0, 0.0);
    for run in runs {
        let joint = &run.joints[0];
        let r = joint.reference.as_ref()?;
        let torque = joint.recorded();
        let mut integral = 0.0;
        for k in 1..run.len().saturating_sub(1) {
            let e = r[k] - joint.q[k];
            integral += e / run.rate;
            if k % every != 0 {
                continue;
            }
            let speed = 0.5 * (r[k + 1] - r[k - 1]) * run.rate;
            let acceleration = (r[k + 1] - 2.0 * r[k] + r[k - 1]) * run.rate * run.rate;
            let (sin, cos) = r[k].sin_cos();
            let row = [
                e,
                speed - joint.qd[k],
                integral,
                speed,
                acceleration,
                sin,
                cos,
                1.0,
            ];
            for (i, a) in row.iter().enumerate() {
                right[i] += a * torque[k];
                for (j, b) in row.iter().enumerate() {
                    normal[(i, j)] += a * b;
                }
            }
            power += torque[k].powi(2);
            mean += torque[k];
            count += 1.0;
        }
    }
    let constant = mean * mean / f64::max(count, 1.0);
    SETS.iter().find_map(|set| {
        // Columns of very different units, some of them nothing at all.
        let scale = |i: usize| {
            let size = normal[(i, i)].sqrt();
            if size > 0.0 { 1.0 / size } else { 0.0 }
        };
        let n = set.len();
        let entry = |a: usize, b: usize| {
            let (i, j) = (set[a], set[b]);
            scale(i) * scale(j) * normal[(i, j)]
        };
        let target = DVector::from_fn(n, |a, _| scale(set[a]) * right[set[a]]);
        let svd = DMatrix::from_fn(n, n, entry).svd(true, true);
        let x = svd.solve(&target, 1.0e-10).ok()?;
        let explained = x.dot(&target) - constant;
        let (kp, kd) = (scale(0) * x[0], scale(1) * x[1]);
        (explained >= EXPLAINED * (power - constant) && kp > 0.0 && kd > 0.0).then_some(
            Controller {
                position_gain: kp / kd,
                velocity_gain: kd,
                torque_gain: 1.0,
            },
        )
    })
}

#[cfg(test)]
mod tests;
