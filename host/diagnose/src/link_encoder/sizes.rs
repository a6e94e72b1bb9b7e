//! Least sizes of the laws of q − ql, and sizes of the signals they are compared with.

use crate::link_encoder::equation::Equation;
use crate::rows::regression::Column;

/// Least RMS share that a law removes: one of half the noise's size removes as much.
pub(crate) const LEAST_SHARE: f64 = 0.1;
/// … for a wave over the joint's turn.
pub(crate) const LEAST_SHARE_OF_THE_JOINT: f64 = 0.3;
/// … and in standard deviations.
pub(crate) const LEAST_SIGMAS: f64 = 2.0;
/// Least size of backlash or twist, in steps of the coarser encoder.
const LEAST_STEPS: f64 = 2.0;
/// Approximate ratio of peak-to-peak to RMS, for any form of signal.
const SWING: f64 = 3.0;

/// Returns the least peak-to-peak backlash or twist.
pub(crate) fn least(equation: &Equation) -> f64 {
    LEAST_STEPS * equation.resolution
}

/// Returns the peak-to-peak gear torque, N·m or N.
pub(crate) fn swing(equation: &Equation) -> f64 {
    SWING * spread(equation, &equation.load)
}

/// Returns the RMS of a column about its mean.
pub(crate) fn spread(equation: &Equation, column: &Column) -> f64 {
    let n = equation.rows.count.max(1) as f64;
    let of = || column[0].iter().flatten();
    let mean = of().sum::<f64>() / n;
    (of().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}
