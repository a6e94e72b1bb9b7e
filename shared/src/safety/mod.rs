//! Faults, limits and the mode of the rig.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// What the rig is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Mode {
    /// Measuring the current sensor's offset; the bridge is off.
    #[default]
    Calibrating,
    /// Bridge off, ready to be armed.
    Disarmed,
    /// Bridge on, holding position.
    Holding,
    /// Running a trajectory.
    Running,
    /// Coming to rest under control.
    Stopping,
    /// A fault is latched; bridge off.
    Fault,
}

/// A reason to switch the bridge off. Latched: the first one stays until cleared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Fault {
    /// The driver chip or comparator pulled the break input.
    Driver,
    /// Motor current beyond its hard limit.
    OverCurrent,
    /// A converter stayed at its rail or did not change.
    AdcStuck,
    /// The current sensor's offset at start is outside its band.
    CurrentOffset,
    /// The encoder jumped further in a tick than the motor can turn.
    EncoderJump,
    /// The motor is driven hard and the encoder stands still.
    EncoderLost,
    /// Joint speed beyond its hard limit.
    OverSpeed,
    /// Joint position beyond its hard limit.
    Position,
    /// Supply voltage out of range.
    Supply,
    /// Motor or bridge too hot.
    Temperature,
    /// Long-term heating (i²t) beyond the motor's rating.
    Overload,
    /// The control tick did not finish in its period.
    Deadline,
    /// The host has been silent for longer than allowed.
    HostSilent,
}

/// Limits that act now, as a set of bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LimitSet(pub u8);

/// What the rig must stay within, joint-side unless said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Limits<T> {
    /// Lowest reference position, rad.
    pub position_low: T,
    /// Highest reference position, rad.
    pub position_high: T,
    /// Highest speed, rad/s.
    pub velocity: T,
    /// Highest acceleration of a reference, rad/s².
    pub acceleration: T,
    /// Highest torque, N·m.
    pub torque: T,
    /// Highest continuous motor current, A.
    pub continuous_current: T,
    /// Highest motor current, A.
    pub peak_current: T,
}

/// The first fault since the last clearing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct FaultRecord {
    /// What happened.
    pub fault: Fault,
    /// Control tick at which it happened.
    pub tick: u64,
    /// The value that was out of range, in the unit of its limit.
    pub value: f32,
}

/// One control tick as the snapshot keeps it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct SnapshotSample {
    /// Control tick.
    pub tick: u64,
    /// Unwrapped encoder counts.
    pub position: i64,
    /// Motor current, A.
    pub current: f32,
    /// Duty cycle, −1 to 1.
    pub duty: f32,
    /// Supply voltage, V.
    pub supply: f32,
    /// Reference position, rad.
    pub reference: f32,
}
