//! Noise of the joint torques in the band of the fit, inferred from the torques above the band, as if it were white.

use rig_data::prepare::{PreprocessingPlan, Recording, each_motion};

use crate::error::LoadError;
use crate::noise_floor::{LEAST_ABOVE, shares, squares_of_difference};

/// Returns for each joint the RMS noise that its torques of all recordings have in the band of the fit, N·m or N; `None` if
/// the band leaves nothing above it.
///
/// # Errors
/// A recording that cannot be read.
pub(crate) fn torque_noise(
    recordings: &[&dyn Recording],
    plan: &PreprocessingPlan,
    joints: usize,
) -> Result<Vec<Option<f64>>, LoadError> {
    let Some(low_pass) = plan.parallel_low_pass() else {
        return Ok(vec![None; joints]);
    };
    let [within, beyond] = shares(&low_pass, plan);
    let (mut sums, mut rows) = (vec![0.0; joints], 0usize);
    for recording in recordings {
        each_motion(*recording, plan, 0, &mut |motion| {
            let (low, high) = motion.sound;
            rows += high - low;
            for (sum, joint) in sums.iter_mut().zip(&motion.joints) {
                let raw = &joint.tau[low..high];
                *sum += squares_of_difference(raw, &low_pass.zero_phase(raw));
            }
            Ok(())
        })?;
    }
    let of = |sum: f64| (sum * within / beyond / rows as f64).sqrt();
    Ok(match rows > 0 && beyond > LEAST_ABOVE {
        true => sums.into_iter().map(|sum| Some(of(sum))).collect(),
        false => vec![None; joints],
    })
}
