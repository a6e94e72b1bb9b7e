//! Angle of a tilted base.

/// Returns angle / tangent of a base tilt. The fit estimates the tangent: gravity across over gravity along the base.
pub(crate) fn turn(slopes: &[f64]) -> f64 {
    let slope = slopes.iter().fold(0.0, |norm: f64, s| norm.hypot(*s));
    if slope == 0.0 {
        1.0
    } else {
        slope.atan() / slope
    }
}
