//! Interface of a line to the rig.

use std::io;
use std::time::Duration;

/// A bidirectional byte stream, with the clock of its time-outs.
pub trait Port {
    /// Waits for bytes and writes them to the start of `into`; returns their number, 0 after `timeout`.
    ///
    /// # Errors
    /// The error of a failed line.
    fn read(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize>;

    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// The error of a failed line.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Returns the time since a fixed moment; real for hardware, emulated for an emulated rig.
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
