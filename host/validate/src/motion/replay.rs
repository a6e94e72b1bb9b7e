//! Recorded torques that drive the model.

use super::stretch::Stretch;
use crate::replay::{of_joints, replayed};
use rig_data::prepare::{LowPass, PreprocessingPlan};
use rig_data::runs::{Run, runs_of_blocks};
use rig_data::{Block, JointColumns};
use rig_model::robot::{Controller, Robot};
use rig_model::simulate::{Model, Motion, SimulateError};

/// Recorded torques that drive the model without a known closed loop.
pub(super) struct Replay {
    /// Controllers that correct deviations from the recorded motion.
    controllers: Vec<Controller>,
    /// Their origin, a sentence.
    pub(super) how: String,
    /// The stretches.
    runs: Vec<Run>,
}

impl Replay {
    /// Builds the replay from stretches; the error states why it is impossible.
    pub(super) fn of(
        robot: &Robot,
        stretches: &[Stretch],
        rate: f64,
        treatment: &PreprocessingPlan,
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
    pub(super) fn over(
        &self,
        robot: &Robot,
        model: &Model,
        k: usize,
        substeps: u32,
    ) -> Result<Motion, SimulateError> {
        let run = &self.runs[k];
        let mut motion = replayed(robot, model, &self.controllers, run, substeps)?;
        for (answer, joint) in motion.tau.iter_mut().zip(&run.joints) {
            (answer.iter_mut().zip(&joint.tau)).for_each(|(answer, torque)| *answer += torque);
        }
        Ok(motion)
    }
}
