//! Control laws of the one-link rig.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Which law turns reference and measurement into a joint torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ControlKind {
    /// PD feedback with gravity and friction feed-forward.
    #[default]
    ProportionalDerivative,
    /// Feedback linearisation with the model.
    ComputedTorque,
    /// Slotine–Li adaptive control.
    Adaptive,
}

/// Feedback gains, joint-side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Gains<T> {
    /// Position gain, N·m/rad.
    pub proportional: T,
    /// Velocity gain, N·m·s/rad.
    pub derivative: T,
    /// Adaptation rate of the adaptive law, 1/s (scales its gain matrix).
    pub adaptation: T,
    /// Closed-loop bandwidth of the current loop, Hz.
    pub current_bandwidth: T,
}
