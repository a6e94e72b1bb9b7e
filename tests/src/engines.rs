//! A Python with other dynamics engines, which tests ask for a second opinion.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Returns the folder of the scripts.
pub fn scripts() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("other_engine")
}

fn has_engines(python: &Path) -> bool {
    Command::new(python)
        .args(["-c", "import mujoco, numpy, pinocchio"])
        .output()
        .is_ok_and(|o| o.status.success())
}

/// Runs a script and returns what it printed.
///
/// # Panics
/// If it fails, with what it said.
pub fn printed(script: &mut Command) -> String {
    let output = script
        .output()
        .unwrap_or_else(|error| panic!("{script:?}: {error}"));
    assert!(
        output.status.success(),
        "{script:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Returns a Python with MuJoCo and Pinocchio: the one named in RIG_PYTHON, `python3`, or else one that is furnished with
/// pip in the folder `place`. Says so if there is none.
pub fn python(place: &Path) -> Option<&'static PathBuf> {
    static FOUND: OnceLock<Option<PathBuf>> = OnceLock::new();
    let find = || {
        let named = std::env::var_os("RIG_PYTHON").map(PathBuf::from);
        let usual = place.join("other_engine");
        let own = usual.join("bin/python");
        for python in named
            .into_iter()
            .chain([PathBuf::from("python3"), own.clone()])
        {
            if has_engines(&python) {
                return Some(python);
            }
        }
        let made = Command::new("python3")
            .args(["-m", "venv"])
            .arg(&usual)
            .output()
            .is_ok_and(|o| o.status.success())
            && Command::new(&own)
                .args(["-m", "pip", "install", "--quiet", "-r"])
                .arg(scripts().join("requirements.txt"))
                .output()
                .is_ok_and(|o| o.status.success());
        (made && has_engines(&own)).then_some(own)
    };
    let found = FOUND.get_or_init(find).as_ref();
    if found.is_none() {
        println!(
            "SKIPPED: no Python with mujoco and pin; install tests/other_engine/requirements.txt and name it in RIG_PYTHON."
        );
    }
    found
}
