//! Times of moves from rest to rest.

/// Peaks of the quintic's velocity and acceleration, in units of distance over time and over time squared.
const QUINTIC: [f64; 2] = [1.875, 5.773_502_691_896_26];

/// Returns the shortest duration of a quintic move within the limits, s.
pub(super) fn move_time(distance: f64, velocity: f64, acceleration: f64) -> f64 {
    let by_velocity = QUINTIC[0] * distance / velocity;
    by_velocity.max((QUINTIC[1] * distance / acceleration).sqrt())
}

/// Rounds a time up to whole microseconds; none if it exceeds 32 bits.
pub(super) fn micros(seconds: f64) -> Option<u32> {
    let whole = (seconds * 1e6).ceil();
    (whole >= 1.0 && whole <= f64::from(u32::MAX)).then_some(whole as u32)
}
