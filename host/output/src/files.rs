//! Atomic writing of files.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use thiserror::Error;

/// Why a file or folder could not be written.
#[derive(Debug, Error)]
#[error("{}: {cause}; choose a place that you may write to.", path.display())]
pub struct WriteError {
    /// The file or folder.
    pub path: PathBuf,
    /// Error of the operating system.
    #[source]
    pub cause: io::Error,
}

/// Creates a temporary file beside `path`, to be filled and then renamed by [`persist`].
///
/// Its permissions follow the user's umask like those of any other file: everybody in the laboratory may read results.
///
/// # Errors
/// Errors of the operating system, or a folder that does not exist.
pub fn temporary(path: &Path) -> io::Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::NotFound,
            format!("the folder {} does not exist", folder.display()),
        ));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".rig-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// Renames a filled temporary file to its final name, in one step.
///
/// # Errors
/// Errors of the operating system; an existing file of that name is then unchanged.
pub fn persist(file: NamedTempFile, path: &Path) -> io::Result<()> {
    file.as_file().sync_all()?;
    file.persist(path).map(drop).map_err(|error| error.error)
}

/// Writes a whole file: first to a temporary file beside it, which is then renamed.
///
/// # Errors
/// [`WriteError`] naming the file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let written = temporary(path).and_then(|mut file| {
        file.write_all(bytes)?;
        persist(file, path)
    });
    written.map_err(|cause| WriteError {
        path: path.into(),
        cause,
    })
}

/// Checks, before long computations, that a folder can take results of these names; creates nothing.
///
/// # Errors
/// [`WriteError`] naming the obstacle.
pub fn can_take(path: &Path, names: &[&str]) -> Result<(), WriteError> {
    let refuse = |path: &Path, cause| {
        Err(WriteError {
            path: path.into(),
            cause,
        })
    };
    let taken = names
        .iter()
        .map(|name| path.join(name))
        .find(|p| p.is_dir());
    if let Some(taken) = taken {
        let cause = io::Error::new(
            io::ErrorKind::IsADirectory,
            "this is a folder, and a file of this name is to be written",
        );
        return refuse(&taken, cause);
    }
    // Missing folders will be created in the first existing one; a broken link exists but is not a folder.
    let there = path
        .ancestors()
        .find(|p| p.as_os_str().is_empty() || p.symlink_metadata().is_ok());
    let there = there
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    if !there.is_dir() {
        let cause = io::Error::new(
            io::ErrorKind::NotADirectory,
            "this is no folder, and a folder is wanted",
        );
        return refuse(there, cause);
    }
    match tempfile::tempfile_in(there) {
        Ok(_) => Ok(()),
        Err(cause) => refuse(there, cause),
    }
}

/// Creates a folder for results if it does not exist.
///
/// # Errors
/// [`WriteError`] naming the folder.
pub fn folder(path: &Path) -> Result<(), WriteError> {
    if path.is_file() {
        return Err(WriteError {
            path: path.into(),
            cause: io::Error::new(
                io::ErrorKind::NotADirectory,
                "this is a file, and a folder is wanted",
            ),
        });
    }
    fs::create_dir_all(path).map_err(|cause| WriteError {
        path: path.into(),
        cause,
    })
}

/// Returns the folder of real recordings: the environment variable `RIG_DATA`, otherwise `../shared/data` beside the
/// project; `None` if neither exists.
pub fn data_dir() -> Option<std::path::PathBuf> {
    if let Some(named) = std::env::var_os("RIG_DATA") {
        return Some(std::path::PathBuf::from(named)).filter(|p| p.is_dir());
    }
    // Cargo sets the crate's folder when it runs a program; otherwise the search starts in the working directory.
    let start = std::env::var_os("CARGO_MANIFEST_DIR").map(std::path::PathBuf::from);
    let start = start.or_else(|| std::env::current_dir().ok())?;
    // Crate, folder of the crates, project, parent of the project, and one more for projects one level deeper.
    let mut folders = start.ancestors().skip(1).take(4);
    folders.find_map(|f| Some(f.join("shared/data")).filter(|p| p.is_dir()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_the_way_is_said_before_and_nothing_is_made() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        assert!(can_take(&at("new/deep"), &["report.html"]).is_ok());
        assert!(!at("new").exists());
        fs::write(at("file"), "").unwrap();
        for path in [at("file"), at("file/deeper")] {
            let error = can_take(&path, &[]).unwrap_err();
            assert_eq!(error.path, at("file"));
            assert!(error.to_string().contains("a folder is wanted"));
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("nowhere/x"), at("dangling")).unwrap();
            assert!(can_take(&at("dangling"), &[]).is_err());
        }
        fs::create_dir_all(at("out/report.html")).unwrap();
        let error = can_take(&at("out"), &["model.toml", "report.html"]).unwrap_err();
        assert_eq!(error.path, at("out/report.html"));
        assert!(can_take(&at("out"), &["model.toml"]).is_ok());
        assert_eq!(fs::read_dir(at("out")).unwrap().count(), 1);
    }
}
