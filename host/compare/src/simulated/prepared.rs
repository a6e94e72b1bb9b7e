//! Preparation of simulated recordings.
//!
//! The automatic choices of `rig identify` are for recordings of unknown noise. On the IRp-6 they cut the position at
//! 0.6 Hz, because that reduces the residual of joints that stick at reversals. 60 rows then remained for 57 parameters.
//! Here the position noise is white, and its spectrum shows where the noise begins. A joint that sticks has friction
//! between its two signs. Filters spread this error to rows near the reversal, so rows of slow joints are left out.

use rig_data::prepare::{Choice, PrepareOptions, PreprocessingPlan, surveyed};
use rig_identify::IdentifyError;
use rig_model::robot::Robot;

use super::recorded::Recorded;

/// Speed below which rows are left out, as a share of the RMS speed of the slowest joint. A third: on seeds 1 and 2 of
/// the IRp-6 (motions of 58.5 s, 50 rows/s) 79 % of the off-line 95 % intervals held the truth without such rows below
/// 4 % of each joint's RMS speed, and 91 % without those below 0.1 rad/s, a third. More costs rows and gains nothing.
const SLOW: f64 = 1.0 / 3.0;
/// Product of decimation and cut-off as a share of the sample rate. The pass band of the low-pass before the decimation
/// is 0.4 of the rate of the rows, so that it passes all that the position filter leaves.
const PASSED: f64 = 0.3;

/// Returns the preparation of a training recording: cut-off by the spectrum of the position, and rows at a rate that
/// keeps its band.
///
/// # Errors
/// [`IdentifyError`]: a recording that is too short.
pub(super) fn prepare(robot: &Robot, training: &Recorded) -> Result<PrepareOptions, IdentifyError> {
    let (surveys, _) = surveyed(&[&training.recording], robot.joints.len())?;
    let own = PrepareOptions::default();
    let plan = PreprocessingPlan::decide(&surveys, &own, &robot.torque_limits())?;
    let decimation = (PASSED * plan.sample_rate / plan.cutoff) as usize;
    Ok(PrepareOptions {
        cutoff: Choice::Fixed(plan.cutoff),
        decimation: Choice::Fixed(decimation.max(1)),
        speed_threshold: Choice::Fixed(SLOW * training.slowest),
        ..own
    })
}
