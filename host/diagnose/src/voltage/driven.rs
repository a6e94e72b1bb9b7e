//! Simulation of a voltage-driven joint by its description.

use crate::DiagnoseError;
use crate::description::described_effects::DescribedEffects;
use crate::voltage::free_run::{FreeRun, travel};
use crate::voltage::halt::{Cause, Halt};
use crate::voltage::law::Supply;
use crate::voltage::log::{Log, Segment};
use crate::voltage::plant::Plant;
use crate::voltage::reading::logs;
use crate::voltage::search::{in_fine_steps, library};
use crate::voltage::simulation::LONGEST;
use crate::voltage::stepper::State;
use rig_data::prepare::Recording;
use rig_model::robot::{Robot, VoltageController};
use rig_shared::effects::Kind;

/// Halvings of the longest step without a residual to compare with: below 0.4 ms.
const REPLAY_HALVINGS: i32 = 4;

/// A voltage-driven joint with the parameters of a description.
pub(crate) struct VoltageModel {
    plant: Plant,
    effects: Vec<Kind>,
    theta: Vec<f64>,
    controller: Option<VoltageController>,
    /// Described effects that the simulation lacks.
    pub(crate) left_out: Vec<Kind>,
}

/// A recording and its simulated motion.
#[derive(Clone, Debug)]
pub(crate) struct Followed {
    /// Name of the recording.
    pub(crate) recording: String,
    /// s
    pub(crate) t: Vec<f64>,
    /// rad or m
    pub(crate) measured: Vec<f64>,
    /// As far as the run went, rad or m.
    pub(crate) simulated: Vec<f64>,
    /// The controller that closes the loop; `None` if the recorded voltage drives.
    pub(crate) controller: Option<VoltageController>,
    /// Result of the run.
    pub(crate) run: FreeRun,
}

/// A reference to follow.
pub(crate) struct Reference {
    /// s
    pub(crate) t: Vec<f64>,
    /// rad or m
    pub(crate) position: Vec<f64>,
    /// Position and velocity at the first row, rad and rad/s (m and m/s).
    pub(crate) start: [f64; 2],
}

/// Reasons why a description gives no model under voltage, or none that can be simulated.
#[derive(Debug, thiserror::Error)]
pub enum DrivenError {
    /// An error of the description or of a recording.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// Parameters are missing.
    #[error(
        "the description of joint {joint} does not state what a voltage makes of it: friction, resistance or torque_constant is missing; `rig diagnose` identifies them and writes model.toml"
    )]
    NotIdentified {
        /// Name of the joint.
        joint: String,
    },
    /// No controller.
    #[error(
        "joint {joint} has no [joint.voltage_controller], so that nothing turns a reference into a voltage; `rig diagnose` finds it in recordings with ref1 and the voltage"
    )]
    NoController {
        /// Name of the joint.
        joint: String,
    },
    /// The simulation cannot go on.
    #[error("the simulation of joint {joint} ends at {time:.3} s: {why}")]
    Halted {
        /// Name of the joint.
        joint: String,
        /// s
        time: f64,
        /// Reason.
        why: Cause,
    },
}

impl VoltageModel {
    /// Builds the model of a description.
    ///
    /// # Errors
    /// [`DrivenError`] if the description is not sufficient.
    pub(crate) fn of(robot: &Robot) -> Result<Self, DrivenError> {
        let mut stated = DescribedEffects::of(robot);
        let plant = Plant::of(&stated.robot)?;
        let parts = stated.driven(&library(&[], false));
        let joint = &robot.joints[0];
        let nominal = plant.described(&stated.robot);
        let nominal = nominal.ok_or_else(|| DrivenError::NotIdentified {
            joint: joint.name.clone(),
        })?;
        let mut theta = nominal.to_vec();
        for (effect, _) in &parts {
            let about = effect.kind.about();
            theta.extend(&effect.gains[..about.gains.len()]);
            theta.extend(&effect.shapes[..about.shapes.len()]);
        }
        let kinds: Vec<Kind> = parts.iter().map(|(effect, _)| effect.kind).collect();
        let stated = robot.effects.iter().map(|effect| effect.effect.kind);
        let left_out = |kind: &Kind| !kinds.contains(kind) && *kind != Kind::Payload;
        Ok(Self {
            left_out: stated.filter(left_out).collect(),
            plant,
            effects: kinds,
            theta,
            controller: joint.voltage_controller,
        })
    }

    /// Simulates recordings, each from its own first state: in the closed loop of the recording's controller with the
    /// described supply, or under the recorded voltage if it shows none. The second result is for all together.
    ///
    /// # Errors
    /// Errors of reading.
    pub(crate) fn follow(
        &self,
        recordings: &[&dyn Recording],
    ) -> Result<(Vec<Followed>, FreeRun), DrivenError> {
        let mut logs = logs(recordings)?;
        let supply = Supply::of(&logs);
        let known = self.controller.map(|controller| controller.supply);
        known
            .map_or(supply, |line| supply.with_line(line))
            .give(&mut logs);
        let travel = travel(&logs);
        let plant = in_fine_steps(&self.plant, &logs, &self.effects, &self.theta);
        let list: Vec<Followed> = (logs.iter())
            .map(|log| self.over(&plant, log, travel))
            .collect();
        let diverged = list.iter().find(|one| one.run.rms().is_none());
        let errors = list
            .iter()
            .flat_map(|one| one.simulated.iter().zip(&one.measured));
        let errors: Vec<f64> = errors.map(|(a, b)| a - b).collect();
        let all = diverged.map_or_else(|| FreeRun::followed(&errors), |one| one.run.clone());
        Ok((list, all))
    }

    fn over(&self, plant: &Plant, log: &Log, travel: f64) -> Followed {
        let mut simulated = Vec::with_capacity(log.t.len());
        let mut halt = None;
        for segment in log.windows(LONGEST) {
            let run = plant.simulate(&self.effects, &self.theta, log, &segment, &mut simulated);
            if let Err(end) = run {
                halt = Some(end);
                break;
            }
        }
        let errors: Vec<f64> = simulated.iter().zip(&log.q).map(|(a, b)| a - b).collect();
        let left = errors.iter().position(|error| !(error.abs() <= travel));
        let run = match (left, halt) {
            (Some(row), _) => FreeRun::diverged(&log.label, log.t[row], Cause::LeftTravel),
            (None, Some(end)) => FreeRun::diverged(&log.label, end.time, end.cause),
            (None, None) => FreeRun::followed(&errors),
        };
        Followed {
            recording: log.label.clone(),
            t: log.t.clone(),
            measured: log.q.clone(),
            simulated,
            controller: log.law,
            run,
        }
    }

    /// Returns the states at the instants of a reference that the described controller follows.
    ///
    /// # Errors
    /// [`DrivenError::NoController`], [`DrivenError::Halted`].
    pub(crate) fn replay(
        &self,
        joint: &str,
        reference: &Reference,
    ) -> Result<Vec<State>, DrivenError> {
        let controller = self.controller.ok_or_else(|| DrivenError::NoController {
            joint: joint.to_owned(),
        })?;
        let rows = reference.t.len();
        let mut log = Log {
            t: reference.t.clone(),
            q: vec![reference.start[0]; rows],
            u: vec![0.0; rows],
            supply: vec![1.0; rows],
            on: vec![true; rows],
            reference: reference.position.clone(),
            law: Some(controller),
            ..Log::default()
        };
        log.read_slopes();
        let whole = Segment {
            from: 0,
            to: rows,
            velocity: reference.start[1],
        };
        let mut states = Vec::with_capacity(rows);
        // There is no residual to compare the steps with.
        let plant = Plant {
            halvings: REPLAY_HALVINGS,
            ..self.plant
        };
        plant
            .run(&self.effects, &self.theta, &log, &whole, &mut |state| {
                states.push(*state)
            })
            .map_err(|Halt { time, cause }| DrivenError::Halted {
                joint: joint.to_owned(),
                time,
                why: cause,
            })?;
        Ok(states)
    }
}

/// Returns the reference of a recording, row by row, and its initial state.
///
/// # Errors
/// Errors of reading.
pub(crate) fn reference_of(recording: &dyn Recording) -> Result<Option<Reference>, DrivenError> {
    let mut whole = Reference {
        t: Vec::new(),
        position: Vec::new(),
        start: [0.0; 2],
    };
    let mut measured = Log::default();
    recording
        .each_block(65_536, &mut |block| {
            if let Some(joint) = block.joints.into_iter().next() {
                whole.position.extend(joint.reference.unwrap_or_default());
                measured.q.extend(joint.q);
            }
            whole.t.extend(block.t);
            Ok(())
        })
        .map_err(DiagnoseError::from)?;
    if whole.position.len() != whole.t.len() || whole.t.is_empty() {
        return Ok(None);
    }
    measured.t = whole.t.clone();
    whole.start = [measured.q[0], measured.slope(0)[0]];
    Ok(Some(whole))
}
