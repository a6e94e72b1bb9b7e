//! The rule of all commands: nothing is overwritten without `--force`.

use std::path::{Path, PathBuf};

use super::error::CommandError;

/// Files with fixed names that commands write into a folder of results.
///
/// All commands refuse a folder that holds any of these files. Two commands would both write report.html, and a user
/// could take a file of an earlier run for a result of the later one.
const RESULTS: &[&str] = &[
    "report.html",
    "report.md",
    "identified.toml",
    "identified.urdf",
    "identification.json",
    "validation.json",
    "model.toml",
    "diagnosis.json",
    "diagnosis.html",
    "next_experiment.toml",
    "friction-map.json",
    "load.toml",
    "load.urdf",
    "load.json",
    "compare.json",
    "pooled.toml",
    "compliance.json",
    "compliance.toml",
    "control.json",
    "inspect.json",
];

/// Further files that the demonstration writes. Other commands ignore them: they may be the user's own recordings.
pub(crate) const DEMONSTRATION: [&str; 8] = [
    "diagnosis.md",
    "train.csv",
    "train-again.csv",
    "holdout.csv",
    "sweep.csv",
    "slow-without.csv",
    "slow-with.csv",
    "tracking.svg",
];

/// Refuses a file that exists.
///
/// # Errors
/// [`CommandError::Exists`].
pub fn refuse_file(path: &Path, force: bool) -> Result<(), CommandError> {
    // A symbolic link without a target exists, too.
    if path.symlink_metadata().is_ok() && !force {
        return Err(CommandError::Exists { path: path.into() });
    }
    Ok(())
}

/// Refuses a folder that holds results of any command or a file named in `besides`.
///
/// # Errors
/// [`CommandError::Results`].
pub fn refuse_folder(
    path: &Path,
    besides: &[&'static str],
    force: bool,
) -> Result<(), CommandError> {
    match held(path, besides) {
        Some(file) if !force => Err(CommandError::Results {
            folder: path.into(),
            file,
        }),
        _ => Ok(()),
    }
}

/// Returns the first result that a folder holds.
fn held(folder: &Path, besides: &[&'static str]) -> Option<&'static str> {
    (RESULTS.iter().chain(besides).copied())
        .find(|name| folder.join(name).symlink_metadata().is_ok())
}

/// Returns the first of `name`, `name-2`, `name-3` … that holds no results and no file named in `besides`.
pub(crate) fn free_folder(name: &str, besides: &[&'static str]) -> PathBuf {
    let numbered = (2u32..).map(|k| PathBuf::from(format!("{name}-{k}")));
    std::iter::once(PathBuf::from(name))
        .chain(numbered)
        .find(|folder| held(folder, besides).is_none())
        .unwrap_or_else(|| PathBuf::from(name))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn whatever_a_command_wrote_is_in_the_way_of_every_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        assert!(refuse_folder(&path.join("new"), &[], false).is_ok());
        std::fs::write(path.join("notes.txt"), "mine").unwrap();
        assert!(refuse_folder(path, &[], false).is_ok());
        for name in RESULTS {
            std::fs::write(path.join(name), "").unwrap();
            let refused = refuse_folder(path, &[], false).unwrap_err().to_string();
            assert!(
                refused.contains(name) && refused.contains("--force"),
                "{refused}"
            );
            assert!(refuse_folder(path, &[], true).is_ok());
            std::fs::remove_file(path.join(name)).unwrap();
        }
        // Only the demonstration refuses a user's own train.csv, because it would write that file.
        std::fs::write(path.join("train.csv"), "mine").unwrap();
        assert!(refuse_folder(path, &[], false).is_ok());
        assert!(refuse_folder(path, &DEMONSTRATION, false).is_err());
        assert!(refuse_file(&path.join("notes.txt"), false).is_err());
        assert!(refuse_file(&path.join("notes.txt"), true).is_ok());
        assert!(refuse_file(&path.join("other.txt"), false).is_ok());
    }
}
