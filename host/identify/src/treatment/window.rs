//! Window length of the integral model.

use crate::error::IdentifyError;
use crate::options::{ModelKind, Options};
use rig_data::prepare::{PreprocessingPlan, Survey};

/// Frequency times window length at which a mean passes half of the power: sin²(πx)/(πx)² = ½.
const HALF_POWER: f64 = 0.443;

/// Returns the window length in samples, and its reason.
///
/// Several joints: the mean passes the band of the differential model. One joint: a sixteenth of the period of the
/// fastest motion, with many samples to average out noise, but short enough to separate acceleration from deceleration.
/// On EMPS, where friction is not quite Coulomb and viscous, a window of 0.4 s moves the offset by 13 %, this one by
/// 1.5 %.
///
/// # Errors
/// [`IdentifyError::Window`]: a given window does not fit the recordings.
pub(crate) fn choose_window(
    options: &Options,
    treatment: &PreprocessingPlan,
    surveys: &[Survey],
) -> Result<(usize, String), IdentifyError> {
    let rate = treatment.sample_rate;
    let shortest = surveys.iter().map(|s| s.longest).min().unwrap_or(0) as f64 / rate;
    let (least, most) = (4.0 / rate, shortest / 20.0);
    let (seconds, reason) = match options.window {
        Some(seconds) => (seconds, format!("{seconds} s, as given.")),
        None => {
            let several = surveys.iter().any(|s| s.joints.len() > 1);
            let wish = if several {
                HALF_POWER / treatment.parallel_edge
            } else {
                0.0625 / treatment.motion_frequency
            };
            let seconds = wish.clamp(least, most.max(least));
            let why = if several {
                format!(
                    "over which a mean passes up to the {:.3} Hz that the differential model's low-pass does",
                    treatment.parallel_edge
                )
            } else {
                format!(
                    "a sixteenth of the period of the fastest motion ({:.3} Hz)",
                    treatment.motion_frequency
                )
            };
            (
                seconds,
                format!("{seconds:.4} s, {why}; windows start every quarter of that."),
            )
        }
    };
    if options.model == ModelKind::Integral && !(seconds >= least && seconds <= most) {
        return Err(IdentifyError::Window {
            window: seconds,
            least,
            most,
        });
    }
    Ok(((seconds * rate).round() as usize, reason))
}
