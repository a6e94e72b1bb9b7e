//! Averages over a window of control ticks, so that slower consumers see no aliases.

use rig_shared::safety::LimitSet;

/// Sums over the ticks of one window. Position and current are read in the same ticks. So their means belong to the
/// same time, except for the delay between the two readings ([`Sample`](crate::sample::Sample)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Ticks so far.
    pub ticks: u16,
    /// Unwrapped counts, exact.
    pub position: i64,
    /// Estimated joint velocity, rad/s.
    pub velocity: f32,
    /// Motor current, A.
    pub current: f32,
    /// Motor voltage, V.
    pub voltage: f32,
    /// Reference position, rad.
    pub reference: f32,
    /// Commanded joint torque, N·m.
    pub torque: f32,
    /// Torque that effects beyond the standard model explain, N·m.
    pub explained: f32,
    /// Correction of the position by effects, rad.
    pub position_error: f32,
    /// Limits that acted at some tick.
    pub limits: LimitSet,
}

/// Contribution of one control tick to a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tick {
    /// Unwrapped counts.
    pub position: i64,
    /// Estimated joint velocity, rad/s.
    pub velocity: f32,
    /// Motor current, A.
    pub current: f32,
    /// Motor voltage that acts now, V.
    pub voltage: f32,
    /// Reference position, rad.
    pub reference: f32,
    /// Commanded joint torque, N·m.
    pub torque: f32,
    /// Torque that effects beyond the standard model explain, N·m.
    pub explained: f32,
    /// Correction of the position by effects, rad.
    pub position_error: f32,
    /// Limits acting.
    pub limits: LimitSet,
}

impl Window {
    /// Adds a tick; returns the finished window once `length` ticks are in, and restarts.
    pub fn push(&mut self, tick: &Tick, length: u16) -> Option<Self> {
        self.ticks += 1;
        self.position += tick.position;
        self.velocity += tick.velocity;
        self.current += tick.current;
        self.voltage += tick.voltage;
        self.reference += tick.reference;
        self.torque += tick.torque;
        self.explained += tick.explained;
        self.position_error += tick.position_error;
        self.limits = self.limits.union(tick.limits);
        (self.ticks >= length).then(|| core::mem::take(self))
    }

    /// Returns the mean of one of the window's sums.
    pub fn mean(&self, sum: f32) -> f32 {
        sum / f32::from(self.ticks.max(1))
    }
}
