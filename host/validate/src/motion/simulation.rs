//! Simulation of the stretches of a recording.

use super::difference::{Accumulated, Change};
use super::reference::first_reference;
use super::replay::Replay;
use super::stretch::{FEWEST_ROWS, Gathered, Stretch, first_state, gather};
use crate::{Options, ValidateError};
use rig_data::prepare::{PreprocessingPlan, Recording, Survey};
use rig_excite::REPLAY_STEP;
use rig_model::robot::{Controller, Robot};
use rig_model::simulate::{Inputs, Model, Motion, SimulateError, closed_loop, controllers};
use rig_output::capital;

/// Initial and largest number of simulation steps per sample.
const SUBSTEPS: [u32; 2] = [4, 64];
/// Change of the motion on halving the step, as a share of the reported error, below which the step is fine enough.
pub(super) const STEP_SHARE: f64 = 0.01;

/// A recording, and the description that is compared with it.
pub(crate) struct Subject<'a> {
    pub robot: &'a Robot,
    pub model: &'a Model,
    pub recording: &'a dyn Recording,
    pub survey: &'a Survey,
    pub treatment: &'a PreprocessingPlan,
    pub options: &'a Options,
}

/// A simulation that is ready to run.
pub(super) struct Simulation<'a> {
    robot: &'a Robot,
    model: &'a Model,
    controllers: Vec<Controller>,
    /// Content of the recording.
    pub(super) gathered: Gathered,
    /// Names of the joints without a described controller.
    pub(super) uncontrolled: Vec<String>,
    /// Recorded torques that drive the model, if a joint has no described controller.
    pub(super) replay: Option<Replay>,
    /// Number of samples of all stretches.
    pub(super) samples: usize,
    /// Sample period, s.
    pub(super) period: f64,
}

/// A simulated motion and its differences.
pub(super) struct Outcome {
    /// Differences to the measured motion.
    pub(super) errors: Accumulated,
    /// One motion per stretch.
    pub(super) motions: Vec<Motion>,
    /// Per joint, change of the motion on halving the step.
    pub(super) change: Vec<Change>,
    /// True if the step is fine enough.
    pub(super) settled: bool,
    /// Steps per sample.
    pub(super) substeps: u32,
}

/// Returns why a described controller cannot follow its reference, if so.
fn zero_gain(robot: &Robot) -> Option<String> {
    let joint = robot.joints.iter().find(|joint| {
        joint
            .controller
            .as_ref()
            .is_some_and(|c| stiffness(c) == 0.0)
    })?;
    Some(format!(
        "A gain of the controller of joint {} is zero, so it does not follow its reference.",
        joint.name
    ))
}

impl<'a> Simulation<'a> {
    /// Collects what a simulation needs; the inner error states why it is impossible.
    pub(super) fn prepare(subject: &Subject<'a>) -> Result<Result<Self, String>, ValidateError> {
        let (robot, model, survey) = (subject.robot, subject.model, subject.survey);
        if let Some(why) = zero_gain(robot) {
            return Ok(Err(why));
        }
        let first = match first_reference(robot, subject.recording)? {
            Ok(first) => first,
            Err(why) => return Ok(Err(why)),
        };
        let (controllers, uncontrolled) = match controllers(robot, model, &first) {
            Ok(found) => found,
            Err(e) => return Ok(Err(capital(&e.to_string()))),
        };
        let most = subject.options.most_samples;
        let gathered = match gather(robot, &controllers, subject.recording, most)? {
            Ok(gathered) => gathered,
            Err(why) => return Ok(Err(why)),
        };
        let samples: usize = gathered.stretches.iter().map(|s| s.t.len()).sum();
        if samples == 0 {
            return Ok(Err(format!(
                "No stretch between gaps in time has {FEWEST_ROWS} rows, the fewest that are simulated."
            )));
        }
        let replay = if uncontrolled.is_empty() {
            None
        } else {
            let rate = survey.sample_rate;
            match Replay::of(robot, &gathered.stretches, rate, subject.treatment) {
                Ok(replay) => Some(replay),
                Err(why) => return Ok(Err(why)),
            }
        };
        Ok(Ok(Self {
            robot,
            model,
            controllers,
            gathered,
            uncontrolled,
            replay,
            samples,
            period: 1.0 / survey.sample_rate,
        }))
    }

    /// Simulates all stretches and doubles the steps per sample until the motion hardly changes; `progress` receives
    /// the completed share. The error is a sentence.
    pub(super) fn refine(
        &self,
        substeps: Option<u32>,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Outcome, String> {
        let [begin, most] = match self.replay {
            None => SUBSTEPS,
            // A torque held over a whole sample does not justify sixteen times the work.
            Some(_) => [(self.period / REPLAY_STEP).ceil().max(1.0) as u32; 2],
        };
        let last = substeps.unwrap_or(most).max(1);
        let mut substeps = substeps.unwrap_or(begin).max(1);
        let failed = |e: SimulateError| capital(&e.to_string());
        // The work doubles from run to run, so the first ones are a small share of it.
        let mut coarse = self
            .run(substeps, &mut |p| progress(0.3 * p))
            .map_err(failed)?;
        loop {
            let fine = self
                .run(2 * substeps, &mut |p| progress(0.3 + 0.6 * p))
                .map_err(failed)?;
            let change = Change::between(&coarse.1, &fine.1);
            let settled = coarse.0.joints.iter().zip(&change).all(|(e, c)| {
                c.position <= STEP_SHARE * e.position_rms()
                    && c.torque <= STEP_SHARE * e.torque_rms()
            });
            if settled || 2 * substeps > last {
                return Ok(Outcome {
                    errors: coarse.0,
                    motions: coarse.1,
                    change,
                    settled,
                    substeps,
                });
            }
            coarse = fine;
            substeps *= 2;
        }
    }

    /// Simulates all stretches with a number of steps per sample; `tell` receives the completed share.
    fn run(
        &self,
        substeps: u32,
        tell: &mut dyn FnMut(f64),
    ) -> Result<(Accumulated, Vec<Motion>), SimulateError> {
        let mut errors = Accumulated::new(self.robot.joints.len());
        let mut motions = Vec::with_capacity(self.gathered.stretches.len());
        let mut before = 0;
        for (s, stretch) in self.gathered.stretches.iter().enumerate() {
            let motion = if let Some(replay) = &self.replay {
                let motion = replay.over(self.robot, self.model, s, substeps)?;
                tell((before + stretch.t.len()) as f64 / self.samples as f64);
                motion
            } else {
                self.closed(stretch, substeps, |k| {
                    if k.is_multiple_of(1024) {
                        tell((before + k) as f64 / self.samples as f64);
                    }
                })?
            };
            before += stretch.t.len();
            errors.push(stretch, &motion);
            motions.push(motion);
        }
        Ok((errors, motions))
    }

    /// Simulates the closed loop over a stretch; `tell` receives the number of completed samples.
    fn closed(
        &self,
        stretch: &Stretch,
        substeps: u32,
        tell: impl FnMut(usize),
    ) -> Result<Motion, SimulateError> {
        let (q, v) = first_state(stretch, self.period);
        // The drive's limit acts on its whole torque. So added torque enters before the limit, as a shift of the
        // reference that makes the controller request the same additional torque.
        let reference: Vec<Vec<f64>> = stretch
            .reference
            .iter()
            .zip(&stretch.added)
            .zip(&self.controllers)
            .map(|((r, a), c)| r.iter().zip(a).map(|(r, a)| r + a / stiffness(c)).collect())
            .collect();
        let inputs = Inputs {
            period: self.period,
            reference: &reference,
            feed_forward: &[],
            added: &[],
            q: &q,
            v: &v,
            substeps,
            held: true,
        };
        closed_loop(self.robot, self.model, &self.controllers, &inputs, tell)
    }
}

/// Returns the controller's torque per position error, N·m/rad or N/m.
fn stiffness(c: &Controller) -> f64 {
    c.torque_gain * c.velocity_gain * c.position_gain
}
