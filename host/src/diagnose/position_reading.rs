//! Torque that is in the counts of an encoder alone: a position that is read in steps is off by up to half of one, and its second
//! derivative by more than any noise of the current. It comes back with the motion, so that two runs of it do not tell.
//!
//! Leaves out: steps that are not even; what a controller makes of them, which moves the joint and is in both.

use super::DiagnoseError;
use super::columns::Source;
use super::floor;
use super::predicted::predict;
use super::rows::Rows;
use super::runs::resolution;
use crate::prepare::{LowPass, central_difference, second_difference};

/// RMS on the rows of the first run that the steps of all positions leave in each joint's torque, N·m or N: the filtered motion
/// read once more in such steps, half a step away, and filtered as it was. What its velocity then says of the direction of
/// friction is in it.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(super) fn rounding(
    source: &Source,
    rows: &Rows,
    filter: &LowPass,
) -> Result<Vec<f64>, DiagnoseError> {
    let joints = rows.joints();
    let Some(run) = source.runs.first() else {
        return Ok(vec![0.0; joints]);
    };
    // The motion passes the filter twice either way: what that takes off it is not of the steps.
    let filtered = |read: &dyn Fn(f64, f64) -> f64| {
        let mut again = run.clone();
        for (joint, own) in again.joints.iter_mut().enumerate() {
            let step = resolution(std::slice::from_ref(run), joint);
            if step == 0.0 {
                continue;
            }
            let positions: Vec<f64> = own.q.iter().map(|q| read(*q, step)).collect();
            own.q = filter.zero_phase(&positions);
            own.qd = central_difference(&own.q, 1.0 / run.rate);
            own.qdd = second_difference(&own.q, 1.0 / run.rate);
        }
        again
    };
    let smooth = filtered(&|q, _| q);
    let read = filtered(&|q, step| step * ((q / step).floor() + 0.5));
    // The source's own prediction may hold effects.
    let [before, after] =
        [&smooth, &read].map(|run| predict(source.nominal, source.robot, &source.values, run));
    let (before, after) = (before?, after?);
    let keep = &rows.keep;
    Ok((after.torque.iter().zip(&before.torque).zip(keep))
        .map(|((after, before), keep)| {
            let apart: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
            let mut thin = Vec::new();
            source.thinning.push(&apart, &mut thin);
            floor::rms(&thin, keep)
        })
        .collect())
}
