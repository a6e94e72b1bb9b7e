//! Faults: reasons to switch the bridge off. They latch.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A reason to switch the bridge off. Latched: the first one stays until cleared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Fault {
    /// The driver chip or comparator pulled the break input.
    Driver,
    /// Motor current beyond its hard limit; the value is in A.
    OverCurrent,
    /// The current converter stayed at its rail or did not change while it had to; the value is its code.
    AdcStuck,
    /// The current sensor's offset at start is outside its band; the value is in A.
    CurrentOffset,
    /// The encoder jumped further in a tick than the motor can turn; the value is in counts.
    EncoderJump,
    /// Nothing drives one of the encoder's wires, or the winding's voltage tells of another speed than the encoder; the
    /// value is the voltage in V that current and encoder leave unexplained.
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
    /// The encoder's channels changed both at once, or its index came at a wrong count; the value is by how many
    /// counts, 0 where the channels were at fault.
    EncoderSignal,
    /// The stack has come near its end; the value is the bytes that are left.
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

/// Keeps the first fault; later ones are consequences more often than causes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaultLatch {
    first: Option<FaultRecord>,
}

impl FaultLatch {
    /// Latches a fault; true if it is the first since the last clearing.
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

    /// Forgets the fault. Whether its cause still acts is the caller's to check.
    pub fn clear(&mut self) {
        self.first = None;
    }
}
