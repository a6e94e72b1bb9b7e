//! Faults: reasons to end every motion. They are latched, and each has a reaction.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A reason to end every motion ([`Fault::reaction`]). Latched: the first one stays until cleared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Fault {
    /// The driver pulled its fault line, or the chip switched its outputs off by itself. The value is the sum of
    /// [`Breaks`](super::monitor::Breaks): 1 for the line, 2 if the comparators saw an over-current as well, 4 for the chip.
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
    /// Control ticks were missed or did not finish in their period: two at once, or one soon after another.
    Deadline,
    /// The host has been silent for longer than allowed; the value is in s.
    HostSilent,
    /// Both encoder channels changed at once, or the index came at a wrong count. The value is the error in counts, 0
    /// if the channels were at fault.
    EncoderSignal,
    /// The stack is nearly full; the value is the free bytes.
    Stack,
    /// The stop switch was opened, or its wire has broken. The motion was stopped under control.
    StopSwitch,
}

/// What the bridge does after a fault. Neither is a safety function: both need a working program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// The bridge goes off: the motor is open-circuit and the link falls. For faults after which bridge, supply or current
    /// sensor cannot be trusted.
    Coast,
    /// The motor brakes by its own voltage at a limited current, then with short-circuited wires. It needs neither the
    /// encoder nor a model of the link. It coasts once its current sensor fails or its speed grows.
    Brake,
}

impl Fault {
    /// Returns what the bridge does if it was on when this fault came.
    pub const fn reaction(self) -> Reaction {
        match self {
            Self::Driver
            | Self::OverCurrent
            | Self::AdcStuck
            | Self::CurrentOffset
            | Self::Supply => Reaction::Coast,
            Self::EncoderJump
            | Self::EncoderLost
            | Self::EncoderSignal
            | Self::OverSpeed
            | Self::Position
            | Self::Temperature
            | Self::Overload
            | Self::Deadline
            | Self::HostSilent
            | Self::Stack
            | Self::StopSwitch => Reaction::Brake,
        }
    }

    /// Returns the name for logs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Driver => "Driver",
            Self::OverCurrent => "OverCurrent",
            Self::AdcStuck => "AdcStuck",
            Self::CurrentOffset => "CurrentOffset",
            Self::EncoderJump => "EncoderJump",
            Self::EncoderLost => "EncoderLost",
            Self::OverSpeed => "OverSpeed",
            Self::Position => "Position",
            Self::Supply => "Supply",
            Self::Temperature => "Temperature",
            Self::Overload => "Overload",
            Self::Deadline => "Deadline",
            Self::HostSilent => "HostSilent",
            Self::EncoderSignal => "EncoderSignal",
            Self::Stack => "Stack",
            Self::StopSwitch => "StopSwitch",
        }
    }
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
