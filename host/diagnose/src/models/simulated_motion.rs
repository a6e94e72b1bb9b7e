//! Position errors of simulated motions ([`rig_validate::replay`]), model by model.

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::models::bodies::ModelCache;
use crate::recordings::context::PreparedData;
use crate::recordings::noise_floor;
use crate::search::fitted_candidate::FittedCandidate;
use rig_data::runs::Run;
use rig_model::robot::{Controller, Robot};
use rig_model::simulate::{Model, SimulateError};
use rig_numerics::autocorrelation::correlation_time_to_zero;
use rig_numerics::optimise::gauss_newton::BlockedResidual;
use rig_numerics::statistics;
use rig_validate::replay::{of_joints, replayed};

/// Longest integration step, s.
const STEP: f64 = 1.0e-3;
/// Rate at which position errors are kept, 1/s; they are smooth.
const DEPARTURES: f64 = 100.0;
/// Length of the blocks that are compared, s.
const BLOCK: f64 = 1.0;
/// Relative increase of the RMS above which a motion is worse …
const WORSE: f64 = 0.02;
/// … and increase of its squares, in standard deviations between blocks.
const SIGMAS: f64 = 3.0;

/// Positions, joint by joint.
pub(crate) type Positions = Vec<Vec<f64>>;

/// Errors of the simulated motion by joint and block: sum of squares and number of rows.
pub(crate) struct Errors(Vec<Vec<[f64; 2]>>);

impl Errors {
    /// Returns the RMS error of a joint, rad or m.
    pub(crate) fn rms(&self, joint: usize) -> f64 {
        let [sum, rows] = (self.0[joint].iter()).fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        (sum / f64::max(rows, 1.0)).sqrt()
    }

    /// Returns true if the errors of a joint are significantly larger than in `before`. Neighbouring blocks are not
    /// independent: friction holds a joint for many blocks where one event has put it, so the blocks count by their
    /// correlation time.
    pub(crate) fn worse_than(&self, before: &Self, joint: usize) -> bool {
        let changes: Vec<f64> = (self.0[joint].iter().zip(&before.0[joint]))
            .map(|(a, b)| a[0] - b[0])
            .collect();
        let n = changes.len() as f64;
        let mean = statistics::mean(&changes);
        let deviations: Vec<f64> = changes.iter().map(|change| change - mean).collect();
        let blocks = correlation_time_to_zero(&deviations, &[0, changes.len()], changes.len());
        let spread = statistics::sum_of_squares(&deviations);
        let std = (blocks.max(1.0) * spread / (n * (n - 1.0))).sqrt();
        self.rms(joint) > (1.0 + WORSE) * before.rms(joint) && mean > SIGMAS * std
    }
}

/// How motions were simulated.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Simulation {
    /// Which controllers are simulated, or why none is; a sentence of the replay.
    pub(crate) how: String,
    /// The first model that could not be simulated.
    pub(crate) failed: Option<Failed>,
}

/// A model that could not be simulated.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Failed {
    /// The last of its effects; None without effects.
    pub(crate) last: Option<Kind>,
    /// Message of the simulation.
    pub(crate) why: String,
}

/// Recordings to be simulated.
pub(crate) struct Replay<'a> {
    fitting: &'a ModelCache<'a, 'a>,
    /// Data that models are judged on.
    pub(crate) judged: &'a PreparedData,
    runs: &'a [Run],
    /// One per joint; `None` if nothing is simulated.
    controllers: Option<Vec<Controller>>,
    /// Which controllers are simulated, or why none is; a sentence.
    how: String,
}

impl<'a> Replay<'a> {
    /// Prepares the simulation of the recordings that models are judged on.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        fitting: &'a ModelCache<'a, 'a>,
        judged: &'a PreparedData,
    ) -> Result<Self, DiagnoseError> {
        let moving = fitting.of(&[])?;
        let (controllers, how) = of_joints(fitting.context.robot, &moving.model, &judged.runs);
        Ok(Self {
            fitting,
            judged,
            runs: &judged.runs,
            controllers,
            how,
        })
    }

    /// Simulates the positions of a model, run by run. The error says why it failed.
    fn simulated(&self, robot: &Robot) -> Result<Vec<Positions>, String> {
        let Some(controllers) = &self.controllers else {
            return Err(self.how.clone());
        };
        let mut alone = robot.clone();
        (alone.effects).retain(|e| !e.effect.kind.is_external());
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

    /// Returns how the motion was simulated, and the first model that could not be. The first `described` effects are from
    /// the description.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn told(
        &self,
        chosen: &[FittedCandidate],
        described: usize,
    ) -> Result<Simulation, DiagnoseError> {
        let mut simulation = Simulation {
            how: self.how.clone(),
            failed: None,
        };
        if self.controllers.is_none() {
            return Ok(simulation);
        }
        for count in described..=chosen.len() {
            if let Err(why) = self.simulated(&self.fitting.of(&chosen[..count])?.model) {
                let last = count.checked_sub(1).map(|k| chosen[k].candidate.kind);
                simulation.failed = Some(Failed { last, why });
                break;
            }
        }
        Ok(simulation)
    }

    /// Returns the position errors of a description; `None` if it cannot be simulated.
    pub(crate) fn errors_of(&self, robot: &Robot) -> Option<Errors> {
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

    /// Returns simulated minus recorded position of a one-joint description, rad or m, 100 times a second; `None` if it
    /// cannot be simulated. Blocks are motion and second; runs of one motion share them.
    pub(crate) fn departures(&self, robot: &Robot) -> Option<BlockedResidual> {
        let simulated = self.simulated(robot).ok()?;
        let repeats = noise_floor::repeats(self.runs);
        let mut found = BlockedResidual::default();
        for (r, (run, q)) in self.runs.iter().zip(&simulated).enumerate() {
            let first = (repeats.iter().filter(|(_, b)| *b == r))
                .map(|(a, _)| *a)
                .min();
            let step = ((run.rate / DEPARTURES).round() as usize).max(1);
            let errors = q[0].iter().zip(&run.joints[0].q).map(|(a, b)| a - b);
            for (k, error) in errors.enumerate().step_by(step) {
                found.values.push(error);
                let stretch = (k as f64 / run.rate / BLOCK) as usize;
                found.blocks.push((first.unwrap_or(r), stretch));
            }
        }
        Some(found)
    }

    /// Returns the position errors of the model with `chosen`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn errors(
        &self,
        chosen: &[FittedCandidate],
    ) -> Result<Option<Errors>, DiagnoseError> {
        if self.controllers.is_none() {
            return Ok(None);
        }
        Ok(self.errors_of(&self.fitting.of(chosen)?.model))
    }

    /// Simulates positions with the first `described` effects and with all of `chosen`, run by run. Each is empty if
    /// that fails, the second also if no effect was found.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn drawn(
        &self,
        chosen: &[FittedCandidate],
        described: usize,
    ) -> Result<[Vec<Positions>; 2], DiagnoseError> {
        if self.controllers.is_none() {
            return Ok(Default::default());
        }
        let of = |part: &[FittedCandidate]| -> Result<_, DiagnoseError> {
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

    /// Returns the first found effect that makes its joint's motion worse: when it was added and, if that can be
    /// simulated, in the full model.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn spoiling(
        &self,
        chosen: &[FittedCandidate],
        described: usize,
    ) -> Result<Option<usize>, DiagnoseError> {
        let mut before = self.errors(&chosen[..described])?;
        for k in described..chosen.len() {
            let after = self.errors(&chosen[..=k])?;
            let joint = chosen[k].candidate.joint;
            let worse = |[a, b]: [&Option<Errors>; 2]| match (a, b) {
                (Some(a), Some(b)) => Some(a.worse_than(b, joint)),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worse_is_what_block_after_block_says() {
        let errors = |blocks: &[f64]| Errors(vec![blocks.iter().map(|s| [*s, 100.0]).collect()]);
        let before = errors(&[1.0, 1.2, 0.9, 1.1, 1.0, 1.0]);
        assert!(errors(&[1.5, 1.8, 1.4, 1.6, 1.5, 1.6]).worse_than(&before, 0));
        assert!(!errors(&[0.5, 0.6, 0.4, 0.5, 0.5, 0.5]).worse_than(&before, 0));
        // A single bad block is not significant, ...
        assert!(!errors(&[1.0, 1.2, 0.9, 4.1, 1.0, 1.0]).worse_than(&before, 0));
        // ... nor is one event that lasts.
        let alike = |k: usize| 1.0 + 0.2 * ((k * 7) % 5) as f64;
        let before = errors(&(0..60).map(alike).collect::<Vec<_>>());
        let held = |k: usize| if k < 40 { 0.8 * alike(k) } else { 4.0 };
        assert!(!errors(&(0..60).map(held).collect::<Vec<_>>()).worse_than(&before, 0));
        let everywhere = |k: usize| 1.5 * alike(k);
        assert!(errors(&(0..60).map(everywhere).collect::<Vec<_>>()).worse_than(&before, 0));
    }
}
