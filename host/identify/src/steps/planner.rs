//! Plans of rows that differ in their treatment and window only.

use super::robot_model::RobotModel;
use crate::rows::cache::RowCache;
use crate::rows::plan::Plan;
use crate::rows::planned::Planned;
use rig_data::prepare::{PreprocessingPlan, Recording, Survey};

/// Builds the plans of an identification.
pub(crate) struct Planner<'a> {
    /// Robot and equations.
    pub model: &'a RobotModel,
    /// Per joint, largest RMS torque of a training recording, N·m or N.
    loudness: Vec<f64>,
}

impl<'a> Planner<'a> {
    /// Creates the planner for training recordings with these surveys.
    pub(crate) fn new(model: &'a RobotModel, surveys: &[Survey]) -> Self {
        let loudness = (0..model.joints())
            .map(|j| {
                surveys
                    .iter()
                    .map(|s| s.joints[j].torque_rms)
                    .fold(0.0, f64::max)
            })
            .collect();
        Self { model, loudness }
    }

    /// Returns the plan for a treatment and a window length in samples, without computed rows.
    pub(crate) fn plan<'b>(&self, treatment: &'b PreprocessingPlan, window: usize) -> Plan<'b>
    where
        'a: 'b,
    {
        Plan {
            chain: &self.model.chain,
            transmission: &self.model.transmission,
            columns: &self.model.base.columns,
            treatment,
            window,
            stride: (window / 4).max(1),
            loudness: self.loudness.clone(),
            one_way: Vec::new(),
            cache: RowCache::default(),
        }
    }
}

/// Combines each recording with its plan.
pub(crate) fn each_planned<'a>(
    list: &[&'a dyn Recording],
    plans: &'a [Plan<'a>],
) -> Vec<Planned<'a>> {
    let pairs = list.iter().zip(plans);
    pairs
        .map(|(&recording, plan)| Planned { recording, plan })
        .collect()
}
