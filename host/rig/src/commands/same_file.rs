//! Whether two paths name one file, or two files with the same content.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

/// Bytes that are compared at once.
const CHUNK: usize = 1 << 16;

/// Resolves a path, so that two names of one file compare equal. A missing file keeps its path.
fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// Returns true if both paths name one file or folder.
pub(crate) fn is_same(a: &Path, b: &Path) -> bool {
    real(a) == real(b)
}

/// Returns true if both files hold the same bytes. A file that cannot be read equals none: its reader says why. Empty files
/// and folders equal none.
pub(crate) fn is_copy(a: &Path, b: &Path) -> bool {
    equal_bytes(a, b).unwrap_or(false)
}

fn equal_bytes(a: &Path, b: &Path) -> io::Result<bool> {
    let [own, other] = [a.metadata()?, b.metadata()?];
    if !own.is_file() || !other.is_file() || own.len() != other.len() || own.len() == 0 {
        return Ok(false);
    }
    let mut readers = [a, b].map(|path| File::open(path).map(BufReader::new));
    let [Ok(first), Ok(second)] = &mut readers else {
        return Ok(false);
    };
    let mut parts = [vec![0; CHUNK], vec![0; CHUNK]];
    let mut left = own.len();
    while left > 0 {
        let size = left.min(CHUNK as u64) as usize;
        first.read_exact(&mut parts[0][..size])?;
        second.read_exact(&mut parts[1][..size])?;
        if parts[0][..size] != parts[1][..size] {
            return Ok(false);
        }
        left -= size as u64;
    }
    Ok(true)
}
