//! Residual that neither noise nor missing effects cause.

use crate::rows::regression::Rows;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::shadow::shadow;
use rig_numerics::statistics;

/// Share of the torque RMS that the treatment may leave: its filters and differences are not exact derivatives.
const TREATED: f64 = 3e-3;

/// Returns squares that neither noise nor missing effects cause. They come from the treatment, and from the mismatch of
/// the effects that reduce the RMS from `before` to `after`.
pub(crate) fn besides(
    chosen: &[FittedCandidate],
    rows: &Rows,
    joint: usize,
    [before, after]: [f64; 2],
) -> f64 {
    let explained = (before * before - after * after).max(0.0);
    let names = chosen.iter().filter(|p| p.candidate.joint == joint);
    let shadow = names.map(shadow).fold(0.0, f64::max) * explained;
    let torque = statistics::rms_of_kept(&rows.torque[joint], &rows.keep[joint]);
    (TREATED * torque).powi(2) + shadow
}
