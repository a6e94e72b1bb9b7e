//! What is found on this computer, before it is judged.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use rig_link::serial::group_of;

/// The target of the chip.
pub(super) const TARGET: &str = "thumbv7em-none-eabihf";

/// What this computer has.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Facts {
    /// Serial ports of boards.
    pub(super) ports: Vec<SerialPort>,
    /// Answer of `probe-rs --version`; none if there is no such program.
    pub(super) probe_tool: Option<Answer>,
    /// Rules that give users access to debug probes; none where the system needs none.
    pub(super) probe_rules: Option<bool>,
    /// Answer of `rustc --version`.
    pub(super) compiler: Option<Answer>,
    /// True if the compiler has the chip's library.
    pub(super) has_target: bool,
    /// Answer of Python to the version of the package.
    pub(super) package: Option<Answer>,
    /// The folder of recordings, and true if it is a folder.
    pub(super) recordings: Option<(PathBuf, bool)>,
}

/// A serial port.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SerialPort {
    /// Its name, such as /dev/ttyACM0.
    pub(super) name: String,
    /// True if this user may read and write.
    pub(super) is_usable: bool,
    /// The group that may.
    pub(super) group: Option<String>,
}

/// What a program answered.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Answer {
    /// The first line of its output.
    Done(String),
    /// The last line of its errors.
    Failed(String),
}

impl Facts {
    /// Looks at the computer. `root` is the folder in place of /. `recordings` is the value of `RIG_DATA`.
    pub(super) fn gather(root: &Path, recordings: Option<OsString>) -> Self {
        let library = answer("rustc", &["--print", "target-libdir", "--target", TARGET]);
        Self {
            ports: ports(root),
            probe_tool: answer("probe-rs", &["--version"]),
            probe_rules: cfg!(target_os = "linux").then(|| has_rules(root)),
            compiler: answer("rustc", &["--version"]),
            has_target: matches!(library, Some(Answer::Done(path)) if Path::new(&path).is_dir()),
            package: answer(
                "python3",
                &["-c", "import rig_dynamics; print(rig_dynamics.__version__)"],
            ),
            recordings: recordings.map(|path| {
                let path = PathBuf::from(path);
                let is_folder = path.is_dir();
                (path, is_folder)
            }),
        }
    }
}

/// Runs a program; none if it is not installed.
fn answer(program: &str, arguments: &[&str]) -> Option<Answer> {
    let output = Command::new(program).args(arguments).output().ok()?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Some(match output.status.success() {
        true => Answer::Done(
            text(&output.stdout)
                .lines()
                .next()
                .unwrap_or_default()
                .into(),
        ),
        false => Answer::Failed(
            text(&output.stderr)
                .lines()
                .last()
                .unwrap_or_default()
                .into(),
        ),
    })
}

/// Returns the ports by which boards appear: USB serial lines of Linux and macOS.
fn ports(root: &Path) -> Vec<SerialPort> {
    let entries = std::fs::read_dir(root.join("dev")).into_iter().flatten();
    let mut names: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    names.retain(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        ["ttyACM", "ttyUSB", "cu.usb"]
            .iter()
            .any(|start| name.starts_with(start))
    });
    names.sort();
    let port = |path: PathBuf| SerialPort {
        is_usable: may_use(&path),
        group: group_of(&path, &root.join("etc/group")),
        name: path.display().to_string(),
    };
    names.into_iter().map(port).collect()
}

/// Returns true if this user may read and write a file. Opening a port could move its control lines or wait for them.
fn may_use(path: &Path) -> bool {
    let mut shell = Command::new("/bin/sh");
    shell
        .args(["-c", "test -r \"$0\" && test -w \"$0\""])
        .arg(path);
    shell.status().is_ok_and(|status| status.success())
}

/// Returns true if udev has rules for debug probes.
fn has_rules(root: &Path) -> bool {
    let folders = [
        "etc/udev/rules.d",
        "usr/lib/udev/rules.d",
        "lib/udev/rules.d",
    ];
    folders.iter().any(|folder| {
        let entries = std::fs::read_dir(root.join(folder)).into_iter().flatten();
        entries.flatten().any(|entry| {
            let name = entry.file_name().to_string_lossy().to_lowercase();
            name.contains("probe-rs") || name.contains("stlink") || name.contains("openocd")
        })
    })
}
