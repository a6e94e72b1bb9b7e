//! A serial port of this computer.

use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

use serialport::{ErrorKind, SerialPort};

use super::error::LinkError;
use super::port::Port;

/// Bit rate of a line that has one; a USB serial device ignores it. 125 batches/s of at most 280 bytes need 0.35 Mbit/s
/// in frames of ten bits, so 921600 leaves more than half of the line free.
pub const DEFAULT_BAUD: u32 = 921_600;

/// A serial port of this computer.
pub struct SerialLine {
    port: Box<dyn SerialPort>,
    opened: Instant,
}

impl SerialLine {
    /// Opens the port `name` (`/dev/ttyACM0`, `COM3`) at `baud` bit/s.
    ///
    /// # Errors
    /// [`LinkError`] with the available ports, or with the group that may open it.
    pub fn open(name: &str, baud: u32) -> Result<Self, LinkError> {
        let port = serialport::new(name, baud)
            .timeout(Duration::from_millis(10))
            .open()
            .map_err(|error| explain(name, error))?;
        Ok(Self {
            port,
            opened: Instant::now(),
        })
    }
}

fn explain(name: &str, source: serialport::Error) -> LinkError {
    let name = name.to_owned();
    match source.kind {
        _ if cfg!(unix) && matches!(std::fs::exists(&name), Ok(false)) => not_found(name),
        ErrorKind::Io(io::ErrorKind::NotFound) => not_found(name),
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
            let mend = permission(&name);
            LinkError::PermissionDenied { name, mend }
        }
        ErrorKind::NoDevice => LinkError::PortBusy { name, source },
        _ => LinkError::Open { name, source },
    }
}

fn not_found(name: String) -> LinkError {
    let available = match serialport::available_ports() {
        Ok(ports) if ports.is_empty() => {
            "this computer has no serial port at all: plug the rig in".to_owned()
        }
        Ok(ports) => {
            let names: Vec<String> = ports.into_iter().map(|port| port.port_name).collect();
            format!("there are {}", names.join(", "))
        }
        Err(error) => format!("which ports there are cannot be told ({error})"),
    };
    LinkError::PortNotFound { name, available }
}

#[cfg(unix)]
fn permission(name: &str) -> String {
    match group_of(Path::new(name), Path::new("/etc/group")) {
        Some(group) => format!(
            "it belongs to the group {group}: run `sudo usermod -aG {group} $USER` and log in again"
        ),
        None => format!("ask its owner (`ls -l {name}`) for read and write access"),
    }
}

/// Returns the name of the group that a file belongs to, from a table in the format of `/etc/group`.
#[cfg(unix)]
pub fn group_of(file: &Path, table: &Path) -> Option<String> {
    use std::os::unix::fs::MetadataExt;
    let gid = std::fs::metadata(file).ok()?.gid();
    group_name(&std::fs::read_to_string(table).ok()?, gid)
}

/// Returns none: this system has no groups of files.
#[cfg(not(unix))]
pub fn group_of(_file: &Path, _table: &Path) -> Option<String> {
    None
}

#[cfg(not(unix))]
fn permission(_name: &str) -> String {
    "close the program that has it".to_owned()
}

/// Returns the name of group `gid` in a table in the format of `/etc/group`.
#[cfg(unix)]
fn group_name(table: &str, gid: u32) -> Option<String> {
    table.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        let number: u32 = fields.nth(1)?.parse().ok()?;
        (number == gid).then(|| name.to_owned())
    })
}

impl Port for SerialLine {
    fn read(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.port
            .set_timeout(timeout.max(Duration::from_millis(1)))?;
        match self.port.read(into) {
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
                ) =>
            {
                Ok(0)
            }
            // A serial line has no end; a disconnected device reads as empty.
            Ok(0) if !into.is_empty() => Err(io::ErrorKind::UnexpectedEof.into()),
            other => other,
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)?;
        self.port.flush()
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod test {
    use super::*;

    #[test]
    fn a_missing_port_is_named() {
        let Err(error) = SerialLine::open("/dev/no-such-port", DEFAULT_BAUD) else {
            panic!("opened a port that does not exist");
        };
        let text = error.to_string();
        assert!(
            text.starts_with("There is no serial port /dev/no-such-port; "),
            "{text}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_forbidden_port_names_its_group() {
        let table = "root:x:0:\ndialout:x:20:someone\nbroken line\n";
        assert_eq!(group_name(table, 20), Some("dialout".to_owned()));
        assert_eq!(group_name(table, 21), None);
        let denied = serialport::Error::new(
            ErrorKind::Io(io::ErrorKind::PermissionDenied),
            "Permission denied",
        );
        let text = explain("/dev/null", denied).to_string();
        assert!(
            text.starts_with("The serial port /dev/null may not be opened by this user; "),
            "{text}"
        );
    }
}
