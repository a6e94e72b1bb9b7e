//! Preparation of simulated recordings.
//!
//! The automatic choices of `rig identify` are for recordings of unknown noise. On the IRp-6 they cut the position at
//! 0.6 Hz, because that reduces the residual of joints that stick at reversals. 60 rows then remained for 57 parameters.
//! Here the position noise is white, and its spectrum shows where the noise begins. It begins high, because a joint that
//! sticks moves with many frequencies.
//!
//! Two things must not reach the rows. Torque and columns pass a common low-pass, but the columns pass the position filter
//! before it. What that filter takes away near its cut-off, and the noise of accelerations that it leaves there, is in the
//! columns alone. So the common low-pass ends below. And a joint that sticks has friction between its two signs. The
//! common low-pass spreads this error over its memory, so the rows within this time are left out, too.

use rig_data::prepare::{Choice, PrepareOptions, PreprocessingPlan, decimator_edge, surveyed};
use rig_identify::IdentifyError;
use rig_model::robot::Robot;

use super::recorded::Recorded;

/// Speed below which rows are left out, as a share of the RMS speed of the slowest joint. A third: on seeds 1 and 2 of
/// the IRp-6 (motions of 58.5 s, 50 rows/s) 79 % of the off-line 95 % intervals held the truth without such rows below
/// 4 % of each joint's RMS speed, and 91 % without those below 0.1 rad/s, a third. More costs rows and gains nothing.
const SLOW: f64 = 1.0 / 3.0;
/// Pass band of the low-pass before the decimation as a share of the cut-off of the position. At two thirds the position
/// filter passes 96 % (order 4, forward and backward) of a
/// signal. At 4/3, where it passes 9 %, 89 % of the off-line intervals of the IRp-6 held the truth (seeds 1 to 6).
const PASS_BAND: f64 = 2.0 / 3.0;
/// Rows beside a slow one that are left out, as periods of the end of that pass band: the memory of the low-pass.
const MEMORY: f64 = 1.0;

/// Returns the preparation of a training recording: cut-off by the spectrum of the position, and rows at a rate that
/// keeps its band.
///
/// # Errors
/// [`IdentifyError`]: a recording that is too short.
pub(super) fn prepare(robot: &Robot, training: &Recorded) -> Result<PrepareOptions, IdentifyError> {
    let (surveys, _) = surveyed(&[&training.recording], robot.joints.len())?;
    let own = PrepareOptions::default();
    let plan = PreprocessingPlan::decide(&surveys, &own, &robot.torque_limits())?;
    // The pass band ends at `decimator_edge`, 0.4 of the rate of the rows.
    let edge = PASS_BAND * plan.cutoff;
    let decimation = (decimator_edge(1, plan.sample_rate) / edge) as usize;
    Ok(PrepareOptions {
        cutoff: Choice::Fixed(plan.cutoff),
        decimation: Choice::Fixed(decimation.max(1)),
        reversal_margin: MEMORY / edge,
        speed_threshold: Choice::Fixed(SLOW * training.slowest),
        ..own
    })
}
