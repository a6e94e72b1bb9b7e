//! What follows from a sample rate: pass bands, trimmed rows, and whether two rates agree.

use super::error::PrepareError;
use super::filter::decimator_edge;
use super::survey::Survey;

/// Returns the pass band of the low-pass over torque and regressor, Hz, and a description of the filter.
pub(super) fn parallel_pass(
    order: usize,
    cutoff: f64,
    decimation: usize,
    rate: f64,
) -> (f64, String) {
    let over = "forward and backward, over torque and every regressor column alike";
    if decimation > 1 {
        let edge = decimator_edge(decimation, rate);
        (
            edge,
            format!("Chebyshev I, order 8, 0.05 dB ripple up to {edge:.3} Hz, {over}"),
        )
    } else {
        (
            cutoff,
            format!("Butterworth, order {order}, {cutoff:.3} Hz, {over}"),
        )
    }
}

/// Rows left out at both ends of every stretch, before decimation.
pub fn trimmed_rows(cutoff: f64, decimation: usize, rate: f64) -> usize {
    ((3.0 * rate / cutoff).ceil() as usize).max(3 * decimation)
}

/// Checks that a recording has this sample rate, within 1 %.
///
/// # Errors
/// [`PrepareError::RateMismatch`].
pub fn same_rate(survey: &Survey, rate: f64) -> Result<(), PrepareError> {
    if (survey.sample_rate / rate - 1.0).abs() > 0.01 {
        return Err(PrepareError::RateMismatch {
            label: survey.label.clone(),
            rate: survey.sample_rate,
            first: rate,
        });
    }
    Ok(())
}
