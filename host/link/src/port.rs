//! What a line to the rig must offer.

use std::io;
use std::time::Duration;

/// A line of bytes in both directions, with the clock by which its time-outs run.
pub trait Port {
    /// Waits for bytes and puts them to the front of `into`; gives their number, 0 when `timeout` has passed.
    ///
    /// # Errors
    /// What the line says when it has broken.
    fn read(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize>;

    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// What the line says when it has broken.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Time since some fixed moment; real for hardware, emulated where the rig is.
    fn now(&self) -> Duration;
}

impl<P: Port + ?Sized> Port for Box<P> {
    fn read(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize> {
        (**self).read(into, timeout)
    }
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).write(bytes)
    }
    fn now(&self) -> Duration {
        (**self).now()
    }
}
