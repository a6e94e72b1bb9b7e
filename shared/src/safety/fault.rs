//! Faults: reasons to switch the bridge off. They are latched.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A reason to switch the bridge off. Latched: the first one stays until cleared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Fault {
    /// The driver chip or comparator pulled the break input.
    Driver,
    /// Motor current beyond its hard limit; the value is in A.
    OverCurrent,
    /// The current converter stayed at its rail, or did not change although the duty did; the value is its code.
    AdcStuck,
    /// The current sensor's offset at start is outside its band; the value is in A.
    CurrentOffset,
    /// The encoder jumped further in a tick than the motor can turn; the value is in counts.
    EncoderJump,
    /// An encoder wire is open, or the winding's voltage shows another speed than the encoder. The value is the voltage
    /// in V that current and encoder leave unexplained.
    EncoderLost,
    /// Joint speed beyond its hard limit; the value is in rad/s.
    OverSpeed,
    /// Joint position beyond its hard limit; the value is in rad.
    Position,
    /// Supply voltage out of range; the value is in V.
    Supply,
    /// Motor or bridge too hot; the value is in °C.
    Temperature,
    /// Long-term heating (i²t) beyond the motor's rating; the value is the thermal mean current in A.
    Overload,
    /// The control tick did not finish in its period.
    Deadline,
    /// The host has been silent for longer than allowed; the value is in s.
    HostSilent,
    /// Both encoder channels changed at once, or the index came at a wrong count. The value is the error in counts, 0
    /// if the channels were at fault.
    EncoderSignal,
    /// The stack is nearly full; the value is the free bytes.
    Stack,
}

/// The first fault since the last clearing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct FaultRecord {
    /// What happened.
    pub fault: Fault,
    /// Control tick at which it happened.
    pub tick: u64,
    /// The value that was out of range, in the unit that [`Fault`] names.
    pub value: f32,
}

/// Keeps the first fault, because later ones are usually consequences.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaultLatch {
    first: Option<FaultRecord>,
}

impl FaultLatch {
    /// Latches a fault; returns true if it is the first since the last clearing.
    pub fn latch(&mut self, record: FaultRecord) -> bool {
        let is_first = self.first.is_none();
        if is_first {
            self.first = Some(record);
        }
        is_first
    }

    /// The latched fault.
    pub fn first(&self) -> Option<FaultRecord> {
        self.first
    }

    /// Clears the fault. The caller must check if its cause still acts.
    pub fn clear(&mut self) {
        self.first = None;
    }
}
