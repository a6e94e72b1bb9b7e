//! Errors of the line.

use std::borrow::Cow;
use std::io;
use std::time::Duration;

use rig_shared::compensation::Role;
use rig_shared::wire::message::{Refusal, SelfTest};
use rig_shared::wire::{EncodeError, EndMismatch};

use crate::bound::out_of_bounds;

/// An error of the line; each text is a whole sentence.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// No such port.
    #[error("There is no serial port {name}; {available}.")]
    PortNotFound {
        /// Requested name.
        name: String,
        /// Available ports, as a clause.
        available: String,
    },
    /// The user may not open it.
    #[error("The serial port {name} may not be opened by this user; {mend}.")]
    PermissionDenied {
        /// Requested name.
        name: String,
        /// Remedy, as a clause.
        mend: String,
    },
    /// Another program uses the port, or it was removed.
    #[error(
        "The serial port {name} cannot be used ({source}); close the program that has it, or plug the rig in again."
    )]
    PortBusy {
        /// Requested name.
        name: String,
        /// Error of the operating system.
        source: serialport::Error,
    },
    /// The port cannot be opened for another reason.
    #[error("The serial port {name} cannot be opened: {source}; check that it is a serial port.")]
    Open {
        /// Requested name.
        name: String,
        /// Error of the operating system.
        source: serialport::Error,
    },
    /// An error of the debug probe.
    #[error(
        "The debug probe cannot reach the rig: {0}; check that the board is plugged in at its ST-LINK socket, that no other program uses it, and that the rig's firmware is on it (`rig flash`)."
    )]
    Probe(String),
    /// No debug probe, or more than one.
    #[error(
        "There are {0} debug probes at this computer, and one is needed; plug the rig's board in, and no other."
    )]
    ProbeCount(usize),
    /// The line failed.
    #[error("The line to the rig has broken: {0}; check the cable and the rig's supply.")]
    Io(#[from] io::Error),
    /// A request does not fit a frame.
    #[error("The request {request} cannot be sent: {source}")]
    Encode {
        /// The request.
        request: String,
        /// Reason.
        source: EncodeError,
    },
    /// No answer.
    #[error(
        "The rig has not answered the request {request} in {attempts} attempts of {} ms each; check that it is powered and that this is its port.",
        .each.as_millis()
    )]
    NoAnswer {
        /// The request.
        request: String,
        /// Number of attempts.
        attempts: u32,
        /// Waiting time of each attempt.
        each: Duration,
    },
    /// The rig refused a request.
    #[error("The rig has refused the request {request}: {}.", describe(*.refusal))]
    Refused {
        /// The request.
        request: String,
        /// Reason.
        refusal: Refusal,
    },
    /// A different protocol version.
    #[error(
        "The rig speaks protocol version {rig} and this program version {host}; flash the firmware that belongs to this program, or use the program that belongs to the firmware."
    )]
    WrongProtocol {
        /// Version of the rig.
        rig: u16,
        /// Version of this program.
        host: u16,
    },
    /// Different message types.
    #[error(
        "The rig's messages have the schema {rig:016x} and this program's {host:016x}; flash the firmware that belongs to this program, or use the program that belongs to the firmware."
    )]
    WrongSchema {
        /// Schema of the rig.
        rig: u64,
        /// Schema of this program.
        host: u64,
    },
    /// A greeting with an impossible value.
    #[error(
        "The rig's greeting says {what} = {value}, which cannot be; its firmware is configured wrongly."
    )]
    BadGreeting {
        /// Name of the field.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The stream stopped.
    #[error("The rig has sent nothing for {} ms while it should stream; check the cable and the rig's supply.", .0.as_millis())]
    Silent(Duration),
    /// The totals at the end of the stream are missing.
    #[error(
        "The rig has not told the totals of its stream in {attempts} attempts, so that losses at its end are unknown; record again."
    )]
    NoEnd {
        /// Number of attempts.
        attempts: u32,
    },
    /// The totals belong to another stream.
    #[error(transparent)]
    EndMismatch(#[from] EndMismatch),
}

/// Describes a refusal as a clause with its remedy.
pub fn describe(refusal: Refusal) -> Cow<'static, str> {
    Cow::Borrowed(match refusal {
        Refusal::WrongMode => {
            "the present mode does not allow it: a motion is started on an armed rig that holds and stopped while it runs; the rest is for a disarmed rig (`rig board disarm`) that has calibrated"
        }
        Refusal::FaultLatched => {
            "a fault is latched; `rig board fault` says which, `rig board clear` forgets it"
        }
        Refusal::CauseActing => "the cause of the fault still acts; remove it first",
        Refusal::BadValue => "a value is not finite or outside its physical range",
        Refusal::NoTrajectory => "no trajectory is loaded; upload one first",
        Refusal::Busy => "the settings are being stored; try again in a moment",
        Refusal::NoStorage => "this rig has no memory that keeps settings",
        Refusal::StorageFailed => {
            "the memory did not take the settings; those stored before still stand"
        }
        Refusal::OutOfBounds {
            quantity,
            value,
            bound,
        } => return Cow::Owned(out_of_bounds(quantity, value, bound)),
        Refusal::SelfTestFailed(SelfTest::Outputs) => {
            "the self-test at the start found that the chip's outputs to the bridge do not follow its commands; check the wires at PA8 and PA9 for a short circuit, then reset the board"
        }
        Refusal::SelfTestFailed(SelfTest::UpperComparator) => {
            "the self-test at the start found that positive over-current would not switch the outputs off; check the wire of the current sense at PC1, then reset the board"
        }
        Refusal::SelfTestFailed(SelfTest::LowerComparator) => {
            "the self-test at the start found that negative over-current would not switch the outputs off; check the wire of the current sense at PB0, then reset the board"
        }
        Refusal::StopSwitchOpen => {
            "the stop switch is open or was open a moment ago, or its wire is broken; close it and try again"
        }
        Refusal::Overtaken => "a disarm or stop that was sent later came first",
        Refusal::NotCompensable(kind) => {
            let about = kind.about();
            return Cow::Owned(format!(
                "the firmware does not compensate {} (the effect `{}`): {}; leave it out",
                about.title,
                about.name,
                Role::refusal(kind).unwrap_or("its list of effects is another one")
            ));
        }
    })
}
