//! Multiples of a right angle, and how near an angle must be to mean one.

use std::f64::consts::FRAC_PI_2;

/// Largest rounding error of an angle with four decimals, rad: 0.05 mm at 1 m, below the resolution of a calibration.
pub(super) const WRITTEN: f64 = 5e-5;

/// Angles (rad) and lengths (m) closer than this to a multiple of π/2 or to zero are rounding of the arithmetic. No
/// remark is given.
pub(super) const ROUNDING: f64 = 1e-10;

/// Returns the multiple of π/2 that lies closer to `angle` than `tolerance`, rad.
pub(super) fn right_angle(angle: f64, tolerance: f64) -> Option<f64> {
    let exact = (angle / FRAC_PI_2).round() * FRAC_PI_2;
    // Adding zero removes the sign of a zero.
    ((angle - exact).abs() < tolerance).then_some(exact + 0.0)
}
