//! The board's debug probe as a line: frames over SEGGER RTT, with probe-rs.
//!
//! Not tested on a board yet.

use std::io;
use std::time::{Duration, Instant};

use probe_rs::probe::list::Lister;
use probe_rs::rtt::Rtt;
use probe_rs::{Permissions, Session};

use super::error::LinkError;
use super::port::Port;

/// Name of the chip in probe-rs.
const CHIP: &str = "STM32G474RETx";
/// Channel of the rig's frames from the board; channel 0 has its logs.
const FROM_BOARD: usize = 1;
/// Channel to the board.
const TO_BOARD: usize = 0;
/// Pause between two reads of the board's buffer, which holds some 40 ms of telemetry.
const PAUSE: Duration = Duration::from_millis(1);

/// The rig behind a debug probe.
pub struct ProbeLine {
    session: Session,
    rtt: Rtt,
    opened: Instant,
}

impl ProbeLine {
    /// Attaches to the only connected probe, and to the program that runs on its board.
    ///
    /// # Errors
    /// [`LinkError::Probe`] with the error of probe-rs; [`LinkError::ProbeCount`].
    pub fn open() -> Result<Self, LinkError> {
        let probes = Lister::new().list_all();
        let [probe] = probes.as_slice() else {
            return Err(LinkError::ProbeCount(probes.len()));
        };
        let mut session = probe
            .open()
            .map_err(explain)?
            .attach(CHIP, Permissions::default())
            .map_err(explain)?;
        let rtt = {
            let mut core = session.core(0).map_err(explain)?;
            Rtt::attach(&mut core).map_err(explain)?
        };
        Ok(Self {
            session,
            rtt,
            opened: Instant::now(),
        })
    }
}

fn explain(error: impl std::error::Error) -> LinkError {
    LinkError::Probe(chain(&error))
}

fn broken(error: impl std::error::Error) -> io::Error {
    io::Error::other(chain(&error))
}

fn missing() -> io::Error {
    io::Error::other("the program on the board is not the rig's: it has other channels")
}

/// Returns the text of an error with all its causes.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(inner) = source {
        text = format!("{text}: {inner}");
        source = inner.source();
    }
    text
}

impl Port for ProbeLine {
    fn read(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let deadline = Instant::now() + timeout;
        let mut core = self.session.core(0).map_err(broken)?;
        let channel = self.rtt.up_channel(FROM_BOARD).ok_or_else(missing)?;
        loop {
            let count = channel.read(&mut core, into).map_err(broken)?;
            if count > 0 || Instant::now() >= deadline {
                return Ok(count);
            }
            std::thread::sleep(PAUSE);
        }
    }

    fn write(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        let mut core = self.session.core(0).map_err(broken)?;
        let channel = self.rtt.down_channel(TO_BOARD).ok_or_else(missing)?;
        let deadline = Instant::now() + Duration::from_secs(1);
        while !bytes.is_empty() {
            let count = channel.write(&mut core, bytes).map_err(broken)?;
            bytes = bytes.get(count..).unwrap_or_default();
            if bytes.is_empty() {
                break;
            }
            if Instant::now() >= deadline {
                return Err(io::ErrorKind::TimedOut.into());
            }
            std::thread::sleep(PAUSE);
        }
        Ok(())
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }
}
