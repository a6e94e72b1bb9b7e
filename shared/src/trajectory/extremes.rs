//! How far, how fast and how hard a trajectory moves.

/// Extreme values of a trajectory, relative to its start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes<T> {
    /// Lowest position, rad.
    pub lowest: T,
    /// Highest position, rad.
    pub highest: T,
    /// Highest speed, rad/s.
    pub velocity: T,
    /// Highest acceleration, rad/s².
    pub acceleration: T,
}
