//! Which model moves as recorded: errors of simulated motions ([`rig_validate::replay`]), model by model.

use super::DiagnoseError;
use super::bench::Loaded;
use super::bodies::Fitting;
use super::floor;
use super::profile::Profile;
use rig_data::runs::Run;
use rig_model::robot::{Controller, Robot, title_of};
use rig_model::simulate::{Model, SimulateError};
use rig_validate::replay::{of_joints, replayed};

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worse_is_what_block_after_block_says() {
        let errors = |blocks: &[f64]| Errors(vec![blocks.iter().map(|s| [*s, 100.0]).collect()]);
        let before = errors(&[1.0, 1.2, 0.9, 1.1, 1.0, 1.0]);
        assert!(errors(&[1.5, 1.8, 1.4, 1.6, 1.5, 1.6]).worse_than(&before, 0));
        assert!(!errors(&[0.5, 0.6, 0.4, 0.5, 0.5, 0.5]).worse_than(&before, 0));
        // One bad block is chance.
        assert!(!errors(&[1.0, 1.2, 0.9, 4.1, 1.0, 1.0]).worse_than(&before, 0));
    }
}
