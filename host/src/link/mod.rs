//! The line to the rig: ports, the conversation over them, and recording.
//!
//! [`port`] is the seam: a [`serial`] device, a debug probe (feature `probe`), an [`emulated`] rig in this process, or either of them behind a
//! [`lossy`] line. [`session`] greets the rig and has requests carried out exactly once; [`recorder`] runs a
//! stream and knows what of it is missing; [`convert`] turns samples into rows of SI quantities; [`fault`] says in words what stopped
//! the rig.

pub mod convert;
pub mod emulated;
pub mod error;
pub mod experiment;
pub mod fault;
pub mod lossy;
pub mod port;
#[cfg(feature = "probe")]
pub mod probe;
pub mod recorder;
pub mod serial;
pub mod session;

pub use convert::{COLUMNS, Converter, Row, UNITS};
pub use emulated::{Device, EmulatedPort};
pub use error::LinkError;
pub use fault::describe_fault;
pub use lossy::{Disturbance, Lossy};
pub use port::Port;
#[cfg(feature = "probe")]
pub use probe::ProbeLine;
pub use recorder::{Event, LossReport, RecordSettings, record};
pub use serial::SerialLine;
pub use session::{Session, SessionSettings};
