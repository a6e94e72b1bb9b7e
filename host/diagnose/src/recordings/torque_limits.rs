//! Described torque limits that the recorded torque exceeds.
//!
//! Rows at a limit carry no information and are excluded, and a simulation stays within the limit. A wrong limit would
//! exclude the most informative rows and restrict the simulated motion.

use crate::description::described_effects::DescribedEffects;
use crate::description::lifted_limit::LiftedLimit;
use rig_data::runs::Run;

/// Factor by which a torque must exceed the limit …
const BEYOND: f64 = 1.05;
/// … and excess in standard deviations of its reading, as readings scatter about a true limit.
const SIGMAS: f64 = 4.0;
/// Least share of all samples beyond the limit.
const LEAST: f64 = 0.005;

impl DescribedEffects {
    /// Removes described limits that the recorded torque exceeds. Returns true if there was one.
    pub(crate) fn lift_limits(&mut self, runs: &[Run]) -> bool {
        let mut lifted = false;
        for (j, joint) in self.robot.joints.iter_mut().enumerate() {
            let Some(limits) = joint.limits.as_mut() else {
                continue;
            };
            let Some(limit) = limits.torque else { continue };
            let own = || runs.iter().filter_map(|run| run.joints.get(j));
            let variances = own().map(|own| own.differences().variance());
            let noise = variances.fold(0.0, f64::max).sqrt();
            let least = (BEYOND * limit).max(limit + SIGMAS * noise);
            let (mut count, mut beyond, mut most) = (0_usize, 0_usize, 0.0f64);
            for own in own() {
                for tau in own.recorded().iter() {
                    count += 1;
                    beyond += usize::from(tau.abs() > least);
                    most = most.max(tau.abs());
                }
            }
            if (beyond as f64) < LEAST * count as f64 || beyond == 0 {
                continue;
            }
            limits.torque = None;
            lifted = true;
            self.lifted.push(LiftedLimit {
                joint: joint.name.clone(),
                unit: joint.kind.units().1,
                most,
                limit,
                percent: 100.0 * beyond as f64 / count as f64,
            });
        }
        lifted
    }
}
