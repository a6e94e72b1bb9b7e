//! Share of the gap between simulation and data.

/// Returns the share of the gap that an RMS drop closes, at most 1; 0 without a gap, NaN if the floor is unknown.
pub(crate) fn closed([before, after]: [f64; 2], floor: f64) -> f64 {
    if floor.is_nan() {
        f64::NAN
    } else if before > floor {
        // Below the floor there is no gap.
        ((before - after) / (before - floor)).min(1.0)
    } else {
        0.0
    }
}
