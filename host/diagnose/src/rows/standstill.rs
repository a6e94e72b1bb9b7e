//! Samples that the rows leave out, because the torque there is not that of the model.
//!
//! Before a reversal, stiction lies anywhere between the Coulomb friction of both directions, so that a model that takes
//! the sign of the velocity is wrong by up to twice the friction. The low-pass of the rows rings, and spreads this error
//! over rows up to five rows away. On a TX40 that was simulated from its exact description (24 ms of standstill at each
//! reversal), it was up to a sixth of the dry friction there, and three times the noise in all rows of a joint.
//!
//! The model is linear in its columns at every sample. So a sample is left out of torque and columns alike, before every
//! filter: what remains is still linear in the same parameters, and nothing of the sample reaches any row. The columns
//! are those of the whole motion; effects with a memory run through.
//!
//! Such samples say nothing. Joints keep all samples but saturated and disturbed ones where more is lost near standstill
//! than dry friction explains (`recordings/rest_rows.rs`), and where they move in one direction only.

use crate::DiagnoseError;
use crate::rows::nominal::Nominal;
use rig_data::prepare::PreprocessingPlan;
use rig_data::runs::{JointRun, Run};

/// Samples of a run whose torque is not that of the model, joint by joint.
pub(crate) struct Doubtful {
    /// The torque is at its limit, or a disturbance acts.
    wrong: Vec<Vec<bool>>,
    /// The same, or the joint stands still, or a motor whose friction is in its torque.
    pub(crate) spoilt: Vec<Vec<bool>>,
    /// The same, a reversal, or so near to one of these that the position filter may have changed the direction.
    pub(crate) blurred: Vec<Vec<bool>>,
}

impl Doubtful {
    /// Finds the samples of a run. `smear` is the time by which the position filter may shift a reversal, s.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        run: &Run,
        nominal: &Nominal,
        treatment: &PreprocessingPlan,
        smear: f64,
    ) -> Result<Self, DiagnoseError> {
        let motors = nominal.slow_motors(run, &treatment.speed_threshold)?;
        let beside = (smear * run.rate).ceil() as usize;
        let mut all = Self {
            wrong: Vec::with_capacity(run.joints.len()),
            spoilt: Vec::with_capacity(run.joints.len()),
            blurred: Vec::with_capacity(run.joints.len()),
        };
        for (j, joint) in run.joints.iter().enumerate() {
            let mut wrong = saturated(joint, j, treatment);
            for part in &run.left_out {
                wrong[part.clone()].fill(true);
            }
            let threshold = treatment.speed_threshold.get(j).copied().unwrap_or(0.0);
            let mut spoilt: Vec<bool> = (wrong.iter().zip(&joint.qd))
                .map(|(wrong, v)| *wrong || v.abs() < threshold)
                .collect();
            for (spoilt, slow) in spoilt.iter_mut().zip(motors.get(j).into_iter().flatten()) {
                *spoilt |= slow;
            }
            all.blurred.push(blurred(&spoilt, &joint.qd, beside));
            all.wrong.push(wrong);
            all.spoilt.push(spoilt);
        }
        Ok(all)
    }

    /// Returns the samples that the rows leave out, joint by joint; empty for none. `rests_count` is true for a joint whose
    /// samples near standstill count.
    pub(crate) fn left_out(self, rests_count: &dyn Fn(usize) -> bool) -> Vec<Vec<bool>> {
        (self.wrong.into_iter().zip(self.blurred).enumerate())
            .map(|(j, (wrong, blurred))| if rests_count(j) { wrong } else { blurred })
            .map(|out| if out.contains(&true) { out } else { Vec::new() })
            .collect()
    }
}

/// Returns the samples at most `beside` samples from a spoilt one or a reversal.
fn blurred(spoilt: &[bool], velocity: &[f64], beside: usize) -> Vec<bool> {
    let mut near = spoilt.to_vec();
    let reverses = |k: usize| k > 0 && velocity[k - 1] * velocity[k] < 0.0;
    for (k, spoilt) in spoilt.iter().enumerate() {
        if *spoilt || reverses(k) {
            let end = (k + beside + 1).min(near.len());
            near[k.saturating_sub(beside)..end].fill(true);
        }
    }
    near
}

fn saturated(joint: &JointRun, j: usize, treatment: &PreprocessingPlan) -> Vec<bool> {
    let [low, high] = treatment.saturation.get(j).copied().unwrap_or_default();
    (joint.recorded().iter())
        .map(|tau| low.is_some_and(|l| *tau <= l) || high.is_some_and(|h| *tau >= h))
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::rows::thinning::Thinning;
    use rig_data::prepare::LowPass;

    const RATE: f64 = 1000.0;
    const STEP: usize = 13;
    const STUCK: std::ops::Range<usize> = 1000..1024;
    const COUNT: usize = 2000;

    fn thinning(filter_matters: bool) -> Thinning {
        let low_pass = LowPass::decimator(STEP, RATE).unwrap();
        let position = LowPass::butterworth(4, 40.0, RATE).unwrap();
        Thinning::of_filters(low_pass, position, filter_matters, STEP)
    }

    fn signal(of: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..COUNT).map(of).collect()
    }

    fn most(rows: impl Iterator<Item = f64>) -> f64 {
        rows.fold(0.0, |most, x| most.max(x.abs()))
    }

    /// A joint sticks for 24 ms at a reversal. Friction rises there from one direction's value to the other's; a model takes the
    /// sign of the velocity.
    #[test]
    fn a_standstill_that_is_left_out_leaks_into_no_row() {
        let sign = |k: usize| if k < 1012 { -1.0 } else { 1.0 };
        let wrong = signal(|k| match STUCK.contains(&k) {
            true => 2.0 * (k as f64 - 1000.0) / 24.0 - 1.0 - sign(k),
            false => 0.0,
        });
        let lacking = signal(|k| 0.05 * (k as f64 * 0.01).sin());
        let both: Vec<f64> = wrong.iter().zip(&lacking).map(|(x, y)| x + y).collect();
        let out: Vec<bool> = (0..COUNT).map(|k| STUCK.contains(&k)).collect();
        for filter_matters in [false, true] {
            let thinning = thinning(filter_matters);
            let rows = |signal: &[f64], left_out: &[bool]| {
                let mut rows = Vec::new();
                thinning.push_raw(signal, left_out, &mut rows);
                rows
            };
            assert_eq!(rows(&both, &out), rows(&lacking, &out));
            // Otherwise rows 40 ms away and more are wrong by more than 2 % of the friction.
            let leaked = rows(&wrong, &[]).into_iter().enumerate();
            let far = leaked.filter(|(row, _)| (row * STEP).abs_diff(1012) > 40);
            assert!(most(far.map(|(_, x)| x)) > 0.02);
        }
    }

    /// A column of the filtered motion loses the same as the torque of the motion itself.
    #[test]
    fn what_is_left_out_of_a_filtered_signal_is_what_is_left_out_of_the_torque() {
        let motion = signal(|k| (k as f64 * 0.02).sin());
        let position = LowPass::butterworth(4, 40.0, RATE).unwrap();
        let filtered = position.zero_phase_even(&motion);
        let out: Vec<bool> = (0..COUNT).map(|k| STUCK.contains(&k)).collect();
        let thinning = thinning(true);
        let [mut torque, mut column] = [Vec::new(), Vec::new()];
        thinning.push_raw(&motion, &out, &mut torque);
        thinning.push(&filtered, &out, &mut column);
        let apart = || torque.iter().zip(&column).map(|(x, y)| x - y);
        assert!(most(apart()) < 1e-3, "{}", most(apart()));
        assert_eq!(thinning.thinned(&[filtered], &[&out])[0], column);
        assert_eq!(thinning.thinned_raw(&[motion], &[&out])[0], torque);
    }

    #[test]
    fn samples_beside_a_standstill_or_a_reversal_are_blurred() {
        let mut spoilt = vec![false; 20];
        spoilt[3] = true;
        let velocity: Vec<f64> = (0..20).map(|k| if k < 12 { 1.0 } else { -1.0 }).collect();
        let near = blurred(&spoilt, &velocity, 2);
        let found: Vec<usize> = (0..20).filter(|k| near[*k]).collect();
        assert_eq!(found, [1, 2, 3, 4, 5, 10, 11, 12, 13, 14]);
    }
}
