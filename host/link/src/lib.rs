//! The line to the rig: ports, the conversation over them, and recording.
//!
//! [`port`] is the interface of all lines: a [`serial`] device, a debug probe (feature `probe`), an [`emulated`] rig in
//! this process, or one of them behind a [`lossy`] or [`paced`] line. [`session`] greets the rig and sends requests that are carried
//! out exactly once. [`recorder`] runs a stream and counts missing samples; [`recorded_run`] writes one experiment to a
//! file. [`convert`] converts samples to rows of SI quantities; [`fault`] describes the fault that stopped the rig,
//! [`learning`] what its on-line estimator has learnt from.
//!
//! ```no_run
//! use rig_link::{SerialLine, Session, SessionSettings};
//!
//! # fn main() -> Result<(), rig_link::LinkError> {
//! let session = Session::open(SerialLine::open("/dev/ttyACM0", 921_600)?, SessionSettings::default())?;
//! println!("{} Hz", session.greeting().control_rate_hz);
//! # Ok(())
//! # }
//! ```

mod bound;
pub mod convert;
pub mod emulated;
pub mod error;
pub mod experiment;
pub mod fault;
pub mod learning;
pub mod lossy;
pub mod paced;
pub mod port;
#[cfg(feature = "probe")]
pub mod probe;
pub mod recorded_run;
pub mod recorder;
pub mod serial;
pub mod session;

pub use convert::{COLUMNS, Converter, Row, UNITS};
pub use emulated::{Device, EmulatedPort};
pub use error::LinkError;
pub use fault::describe_fault;
pub use learning::{LearningLog, describe_learning};
pub use lossy::{Disturbance, Lossy};
pub use paced::Paced;
pub use port::Port;
#[cfg(feature = "probe")]
pub use probe::ProbeLine;
pub use recorded_run::{RecordedRun, RunError};
pub use recorder::{Event, LossReport, RecordSettings, Stream, record};
pub use serial::SerialLine;
pub use session::{Session, SessionSettings};
