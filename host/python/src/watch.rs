//! Progress and interruption of long work.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use rig::commands::CommandError;

use crate::error::{Error, raised_as};

/// Time between two looks at Python's signals, and between two calls of the user's function.
const BETWEEN: Duration = Duration::from_millis(50);

/// The caller no longer waits for the work.
pub(crate) struct Interrupted;

/// What the work and its caller tell each other.
#[derive(Default)]
pub(crate) struct Watch {
    /// Bits of the largest share so far. A pass that ends early gives its share back, which nobody wants to see.
    share: AtomicU64,
    abandoned: AtomicBool,
}

impl Watch {
    /// Reports that `share` (0 to 1) of the work is done.
    ///
    /// # Errors
    /// The caller has been interrupted.
    pub(crate) fn at(&self, share: f64) -> Result<(), Interrupted> {
        let most = self.share().max(share.clamp(0.0, 1.0));
        self.share.store(most.to_bits(), Ordering::Relaxed);
        match self.abandoned.load(Ordering::Relaxed) {
            true => Err(Interrupted),
            false => Ok(()),
        }
    }

    /// As [`Self::at`], for libraries whose progress function cannot return an error: an interruption unwinds the stack
    /// of the work, as a panic does, but silently.
    pub(crate) fn at_or_unwind(&self, share: f64) {
        if self.at(share).is_err() {
            resume_unwind(Box::new(()));
        }
    }

    fn share(&self) -> f64 {
        f64::from_bits(self.share.load(Ordering::Relaxed))
    }
}

/// Result of the work, or its panic.
type Ended<R> = Result<Result<R, CommandError>, Box<dyn Any + Send>>;

/// Runs `work` in a thread of its own while the caller looks for Ctrl-C and calls `callback` with the share that is
/// done. `shown` changes the text of an error.
///
/// An interruption returns at once. The abandoned work ends when it next reports its progress.
///
/// # Errors
/// The error of `work`, Ctrl-C, or an exception of `callback`.
pub(crate) fn run<R: Send + 'static>(
    py: Python<'_>,
    callback: Option<&Py<PyAny>>,
    shown: &dyn Fn(String) -> String,
    work: impl FnOnce(&Watch) -> Result<R, CommandError> + Send + 'static,
) -> PyResult<R> {
    let watch = Arc::new(Watch::default());
    let (send, mut receive) = channel::<Ended<R>>();
    let theirs = Arc::clone(&watch);
    thread::spawn(move || {
        let ended = catch_unwind(AssertUnwindSafe(|| work(&theirs)));
        // Nobody receives what was abandoned.
        let _ = send.send(ended);
    });
    let tell = |share: f64| callback.map_or(Ok(()), |own| own.call1(py, (share,)).map(drop));
    loop {
        let (ended, back) = py.detach(move || (receive.recv_timeout(BETWEEN), receive));
        receive = back;
        match ended {
            Ok(Ok(done)) => {
                let done = done.map_err(|e| raised_as(&e, shown(e.to_string())))?;
                tell(1.0)?;
                return Ok(done);
            }
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Error::new_err(
                    "The work ended without a result.".to_owned(),
                ));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        let told = py.check_signals().and_then(|()| tell(watch.share()));
        if let Err(error) = told {
            watch.abandoned.store(true, Ordering::Relaxed);
            return Err(error);
        }
    }
}
