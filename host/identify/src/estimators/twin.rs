//! Every recording with a companion motion: rows of the model from two motions side by side.
//!
//! The companion's positions pass the same filters, differences and decimation as the measured ones. So simulated or
//! disturbed regressors match the measured ones row by row. Memory is that of one recording.

use super::problem::Problem;
use crate::error::IdentifyError;
use crate::options::ModelKind;
use crate::rows::equation::Rows;
use crate::rows::stream::rows_of;
use crate::rows::tally::Tally;
use rig_data::prepare::{
    LowPass, Motion, PrepareError, PreprocessingPlan, Recording, central_difference, each_motion,
    second_difference,
};
use rig_data::{Block, JointColumns};

/// Source of the companion's positions, block by block from the first row of a recording.
pub(crate) trait Companion {
    /// Returns the positions of every joint over the rows of `block`.
    fn positions(&mut self, block: &Block) -> Result<Vec<Vec<f64>>, PrepareError>;
}

/// Origin of the companion's motion.
pub(crate) enum Twin<'a> {
    /// A new companion for each pass over the recording of this index.
    Made(&'a dyn Fn(usize) -> Result<Box<dyn Companion + 'a>, IdentifyError>),
    /// The measured motion after a further low-pass.
    Smoothed(LowPass),
}

/// A recording with the companion's joints appended to the robot's.
struct Doubled<'a> {
    inner: &'a dyn Recording,
    companion: std::cell::RefCell<Box<dyn Companion + 'a>>,
}

impl Recording for Doubled<'_> {
    fn label(&self) -> String {
        self.inner.label()
    }

    fn unburdened(&self) -> bool {
        self.inner.unburdened()
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        self.inner.each_block(rows, &mut |mut block| {
            let positions = self.companion.borrow_mut().positions(&block)?;
            let more: Vec<JointColumns> = positions
                .into_iter()
                .zip(&block.joints)
                .map(|(q, joint)| JointColumns {
                    q,
                    tau: joint.tau.clone(),
                    effects: joint.effects.clone(),
                    ..Default::default()
                })
                .collect();
            block.joints.extend(more);
            take(block)
        })
    }
}

/// Calls `take` with the recording's index, the measured rows and the companion's rows, piece by piece.
pub(crate) fn each_pair(
    problem: &Problem,
    twin: &Twin,
    take: &mut dyn FnMut(usize, &Rows, &Rows),
) -> Result<(), IdentifyError> {
    let (plan, model) = (problem.plan, problem.options.model);
    let window = match model {
        ModelKind::Differential => 0,
        ModelKind::Integral => plan.window,
    };
    for (r, recording) in problem.sources.iter().enumerate() {
        let mut tally = Tally::default();
        let mut both = |measured: &Motion, other: &Motion| {
            let first = rows_of(measured, plan, model, &mut tally)?;
            let second = rows_of(other, plan, model, &mut Tally::default())?;
            take(r, &first, &second);
            Ok(())
        };
        match twin {
            Twin::Made(make) => {
                let doubled = Doubled {
                    inner: *recording,
                    companion: make(r)?.into(),
                };
                each_motion(&doubled, &twice(plan.treatment), window, &mut |motion| {
                    let (measured, other) = halves(motion);
                    both(&measured, &other)
                })?;
            }
            Twin::Smoothed(low_pass) => {
                let dt = plan.treatment.dt();
                let reach = window + low_pass.settle_samples();
                each_motion(*recording, plan.treatment, reach, &mut |motion| {
                    let mut other = motion.clone();
                    for joint in &mut other.joints {
                        joint.q = low_pass.zero_phase(&joint.q);
                        joint.qd = central_difference(&joint.q, dt);
                        joint.qdd = second_difference(&joint.q, dt);
                    }
                    both(motion, &other)
                })?;
            }
        }
    }
    Ok(())
}

/// Returns the treatment of a robot and its companion: the same twice.
fn twice(treatment: &PreprocessingPlan) -> PreprocessingPlan {
    let mut both = treatment.clone();
    both.speed_threshold.extend(&treatment.speed_threshold);
    both.judged_speed.extend(&treatment.judged_speed);
    both.saturation.extend(&treatment.saturation);
    // The companion has positions only, so both motions get their derivatives from positions.
    both.measured_derivatives = false;
    both
}

fn halves(motion: &Motion) -> (Motion, Motion) {
    let n = motion.joints.len() / 2;
    let part = |joints: &[rig_data::prepare::JointMotion]| Motion {
        joints: joints.to_vec(),
        t: motion.t.clone(),
        extra: motion.extra.clone(),
        ..*motion
    };
    (part(&motion.joints[..n]), part(&motion.joints[n..]))
}
