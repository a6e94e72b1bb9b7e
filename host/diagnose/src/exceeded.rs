//! Torque limits of the description that the recorded torque goes beyond, which are none.
//!
//! A limit cuts the torque: rows at it tell nothing and are left out, and a simulation goes no further. Taken for true where it
//! is not, it leaves out just the rows that tell most, and holds back the simulated motion.

use super::stated::Stated;
use rig_data::runs::Run;
use rig_output::{format_significant, format_unit};

/// How far beyond the limit a torque has to be, as a factor …
const BEYOND: f64 = 1.05;
/// … and in standard deviations of its reading: readings of a torque that is at its limit spread about it.
const SIGMAS: f64 = 4.0;
/// Share of all samples that have to be there.
const LEAST: f64 = 0.005;

impl Stated {
    /// Leaves limits out of the description that the recorded torque goes beyond; whether there was one.
    pub(super) fn lift_limits(&mut self, runs: &[Run]) -> bool {
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
            let unit = format_unit(joint.kind.units().1);
            self.lifted.push(format!(
                "The torque of joint {} goes up to {} {unit}, beyond the {} {unit} that the description gives as its limit, for {} % of the time: that limit was left out, here and in the description that comes out. Correct it, or check the unit, the gear ratio and the torque constant.",
                joint.name,
                format_significant(most, 3),
                format_significant(limit, 3),
                format_significant(100.0 * beyond as f64 / count as f64, 2),
            ));
        }
        lifted
    }
}
