//! A rig in this process instead of a serial line.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use super::port::Port;

/// The other end of the line: the emulated rig, or a test.
pub trait Device {
    /// Runs one time slice of the device: takes the bytes from the host and appends its own.
    fn exchange(&mut self, from_host: &[u8], to_host: &mut Vec<u8>);

    /// Returns the length of one slice; 1 ms by default.
    fn slice(&self) -> Duration {
        Duration::from_millis(1)
    }
}

impl<F: FnMut(&[u8], &mut Vec<u8>)> Device for F {
    fn exchange(&mut self, from_host: &[u8], to_host: &mut Vec<u8>) {
        self(from_host, to_host);
    }
}

/// A line to a [`Device`] that runs only while the host waits for it. The clock is the device's, so runs are repeatable
/// and as fast as the computer allows.
pub struct EmulatedPort<D> {
    device: D,
    now: Duration,
    to_device: Vec<u8>,
    to_host: VecDeque<u8>,
    scratch: Vec<u8>,
}

impl<D: Device> EmulatedPort<D> {
    /// Creates a line to `device`.
    pub fn new(device: D) -> Self {
        Self {
            device,
            now: Duration::ZERO,
            to_device: Vec::new(),
            to_host: VecDeque::new(),
            scratch: Vec::new(),
        }
    }

    /// Returns the device, for inspection after a run.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// Returns the device, for changes between reads.
    pub fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    fn step(&mut self) {
        self.device.exchange(&self.to_device, &mut self.scratch);
        self.to_device.clear();
        self.to_host.extend(self.scratch.drain(..));
        // A device with a slice of zero must not stop the clock of the time-outs.
        self.now += self.device.slice().max(Duration::from_nanos(1));
    }
}

impl<D: Device> Port for EmulatedPort<D> {
    fn read(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let deadline = self.now + timeout;
        while self.to_host.is_empty() && self.now < deadline {
            self.step();
        }
        let count = into.len().min(self.to_host.len());
        for (place, byte) in into.iter_mut().zip(self.to_host.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.to_device.extend_from_slice(bytes);
        Ok(())
    }

    fn now(&self) -> Duration {
        self.now
    }
}
