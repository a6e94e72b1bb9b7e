//! Files that appear whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a file or folder could not be written.
#[derive(Debug, Error)]
#[error("{}: {cause}; choose a place that you may write to.", path.display())]
pub struct WriteError {
    /// The file or folder.
    pub path: PathBuf,
    /// What the system said.
    #[source]
    pub cause: io::Error,
}

/// Writes a whole file: to a temporary one beside it first, which then takes its name.
///
/// # Errors
/// [`WriteError`] naming the file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let at = |cause| WriteError {
        path: path.into(),
        cause,
    };
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(at(io::Error::new(
            io::ErrorKind::NotFound,
            format!("the folder {} does not exist", folder.display()),
        )));
    }
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(at)?;
    file.write_all(bytes).map_err(at)?;
    make_readable(&file).map_err(at)?;
    file.persist(path).map_err(|error| at(error.error))?;
    Ok(())
}

/// Temporary files are private; a result is for everybody in the laboratory to read.
#[cfg(unix)]
fn make_readable(file: &tempfile::NamedTempFile) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.as_file()
        .set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_file: &tempfile::NamedTempFile) -> io::Result<()> {
    Ok(())
}

/// Makes sure that a folder for results is there.
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
