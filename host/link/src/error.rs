//! What can go wrong on the line.

use std::borrow::Cow;
use std::io;
use std::time::Duration;

use rig_shared::compensation::Role;
use rig_shared::wire::message::Refusal;
use rig_shared::wire::{EncodeError, EndMismatch};

/// What can go wrong on the line; each text is a whole sentence.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// No such port.
    #[error("There is no serial port {name}; {available}.")]
    PortNotFound {
        /// As asked for.
        name: String,
        /// What there is instead, as a clause.
        available: String,
    },
    /// The user may not open it.
    #[error("The serial port {name} may not be opened by this user; {mend}.")]
    PermissionDenied {
        /// As asked for.
        name: String,
        /// What to do, as a clause.
        mend: String,
    },
    /// Another program has it, or it is gone.
    #[error(
        "The serial port {name} cannot be used ({source}); close the program that has it, or plug the rig in again."
    )]
    PortBusy {
        /// As asked for.
        name: String,
        /// What the system says.
        source: serialport::Error,
    },
    /// The port cannot be opened for another reason.
    #[error("The serial port {name} cannot be opened: {source}; check that it is a serial port.")]
    Open {
        /// As asked for.
        name: String,
        /// What the system says.
        source: serialport::Error,
    },
    /// The debug probe.
    #[error(
        "The debug probe cannot reach the rig: {0}; check that the board is plugged in at its ST-LINK socket, that no other program uses it, and that the rig's firmware is on it (`rig flash`)."
    )]
    Probe(String),
    /// None to talk to, or more than one.
    #[error(
        "There are {0} debug probes at this computer, and one is needed; plug the rig's board in, and no other."
    )]
    ProbeCount(usize),
    /// The line broke.
    #[error("The line to the rig has broken: {0}; check the cable and the rig's supply.")]
    Io(#[from] io::Error),
    /// A request does not fit a frame.
    #[error("The request {request} cannot be sent: {source}")]
    Encode {
        /// Which.
        request: String,
        /// Why.
        source: EncodeError,
    },
    /// No answer.
    #[error(
        "The rig has not answered the request {request} in {attempts} attempts of {} ms each; check that it is powered and that this is its port.",
        .each.as_millis()
    )]
    NoAnswer {
        /// Which.
        request: String,
        /// How often it was sent.
        attempts: u32,
        /// How long each waited.
        each: Duration,
    },
    /// The rig said no.
    #[error("The rig has refused the request {request}: {}.", describe(*.refusal))]
    Refused {
        /// Which.
        request: String,
        /// Why.
        refusal: Refusal,
    },
    /// Another protocol.
    #[error(
        "The rig speaks protocol version {rig} and this program version {host}; flash the firmware that belongs to this program, or use the program that belongs to the firmware."
    )]
    WrongProtocol {
        /// The rig's.
        rig: u16,
        /// This program's.
        host: u16,
    },
    /// Other message types.
    #[error(
        "The rig's messages have the schema {rig:016x} and this program's {host:016x}; flash the firmware that belongs to this program, or use the program that belongs to the firmware."
    )]
    WrongSchema {
        /// The rig's.
        rig: u64,
        /// This program's.
        host: u64,
    },
    /// A greeting that cannot be true.
    #[error(
        "The rig's greeting says {what} = {value}, which cannot be; its firmware is configured wrongly."
    )]
    BadGreeting {
        /// Which field.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The stream fell silent.
    #[error("The rig has sent nothing for {} ms while it should stream; check the cable and the rig's supply.", .0.as_millis())]
    Silent(Duration),
    /// The stream's end never came.
    #[error(
        "The rig has not told the totals of its stream in {attempts} attempts, so that losses at its end are unknown; record again."
    )]
    NoEnd {
        /// How often it was asked.
        attempts: u32,
    },
    /// The stream's end is not that of this stream.
    #[error(transparent)]
    EndMismatch(#[from] EndMismatch),
}

/// A refusal as a clause that says what to do.
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
        Refusal::OutsideLimits => {
            "the trajectory would leave the limits; make it smaller or slower"
        }
        Refusal::NoTrajectory => "no trajectory is loaded; upload one first",
        Refusal::Busy => "the settings are being stored; try again in a moment",
        Refusal::NoStorage => "this rig has no memory that keeps settings",
        Refusal::StorageFailed => {
            "the memory did not take the settings; those stored before still stand"
        }
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
