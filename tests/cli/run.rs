//! Running the program and looking at what it says.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program under test.
pub(crate) fn rig() -> Command {
    Command::new(env!("CARGO_BIN_EXE_rig"))
}

/// A description that ships with the project.
pub(crate) fn robot(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../robots")
        .join(name)
}

/// The real recordings, or nothing after having said so.
pub(crate) fn real_data(folder: &str) -> Option<PathBuf> {
    let found = rig_output::data_dir()
        .map(|dir| dir.join(folder))
        .filter(|dir| dir.is_dir());
    if found.is_none() {
        println!(
            "skipped: no recordings {folder} here; set RIG_DATA to the folder that holds them"
        );
    }
    found
}

/// Standard output of a run that must succeed.
pub(crate) fn succeed(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(
        output.status.success(),
        "{command:?}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap()
}

/// The one sentence of a run that must fail.
pub(crate) fn refuse(command: &mut Command) -> String {
    let output: Output = command.output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success(), "{command:?} succeeded");
    assert!(output.status.code().is_some(), "{command:?} was killed");
    let lines: Vec<&str> = text.lines().collect();
    let [sentence] = lines.as_slice() else {
        panic!("{command:?} said more than one line:\n{text}")
    };
    assert!(
        sentence.starts_with("rig: error: ") && !sentence.contains("panicked"),
        "{sentence}"
    );
    (*sentence).to_string()
}
