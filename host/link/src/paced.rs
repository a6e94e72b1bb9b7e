//! An emulated rig in real time.

use std::io;
use std::time::{Duration, Instant};

use super::port::Port;

/// Longest sleep between two looks at the clock: a fraction of a telemetry batch.
const NAP: Duration = Duration::from_millis(2);
/// Lag behind the clock that is made up for; a longer one is given up, so that the rig does not run fast afterwards.
const LARGEST_LAG: Duration = Duration::from_millis(250);

/// A port whose own clock is held back to the clock of this computer. An emulated rig runs as fast as it can; behind
/// this port one of its seconds takes a second. On a computer that is too slow for that, it takes longer.
pub struct Paced<P> {
    inner: P,
    /// The moment at which the inner clock read zero.
    zero: Instant,
}

impl<P: Port> Paced<P> {
    /// Creates the port in front of `inner`, whose clock goes on from its present time.
    pub fn new(inner: P) -> Self {
        let now = Instant::now();
        let zero = now.checked_sub(inner.now()).unwrap_or(now);
        Self { inner, zero }
    }

    /// Returns how far the inner clock is behind.
    fn due(&mut self) -> Duration {
        let lag = self.zero.elapsed().saturating_sub(self.inner.now());
        if lag > LARGEST_LAG {
            self.zero += lag - LARGEST_LAG;
        }
        lag.min(LARGEST_LAG)
    }
}

impl<P: Port> Port for Paced<P> {
    fn read(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let deadline = self.inner.now() + timeout;
        loop {
            let left = deadline.saturating_sub(self.inner.now());
            let due = self.due().min(left);
            if !due.is_zero() || left.is_zero() {
                let count = self.inner.read(into, due)?;
                if count > 0 || left.is_zero() {
                    return Ok(count);
                }
            } else {
                std::thread::sleep(NAP.min(left));
            }
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.inner.write(bytes)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::EmulatedPort;

    /// A device that sends one byte a millisecond of its own time.
    #[test]
    fn a_second_of_the_device_is_a_second_here() {
        let device = |_: &[u8], to_host: &mut Vec<u8>| to_host.push(7);
        let mut port = Paced::new(EmulatedPort::new(device));
        let begin = Instant::now();
        let (mut bytes, mut count) = ([0; 64], 0);
        while begin.elapsed() < Duration::from_millis(300) {
            count += port.read(&mut bytes, Duration::from_millis(5)).unwrap();
        }
        // Never ahead; a busy computer may be behind.
        let elapsed = begin.elapsed().as_millis() as usize;
        assert!(count > 0 && count <= elapsed + 2, "{count} in {elapsed} ms");
        assert!(port.now() <= begin.elapsed() + Duration::from_millis(2));
    }
}
