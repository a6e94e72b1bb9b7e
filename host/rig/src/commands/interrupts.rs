//! Ctrl-C, and the signals that end a program, while the rig is recorded.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use super::error::CommandError;

/// Whether the program has been asked to end since the recording began.
static ASKED: AtomicBool = AtomicBool::new(false);
/// The file that is being written under a hidden name.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Listens to Ctrl-C, SIGTERM and SIGHUP from now on: the link is then brought to rest before the program ends, and what was
/// recorded is kept. At the second request the program ends at once: it removes `unfinished`, and the rig stops by itself when
/// it no longer hears anything.
///
/// # Errors
/// [`CommandError::Sentence`] where the system does not allow it.
pub(super) fn listen(unfinished: &Path) -> Result<(), CommandError> {
    // A process has one handler; the program as a library records more than once.
    static LISTENING: OnceLock<Result<(), String>> = OnceLock::new();
    *UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner) = Some(unfinished.to_path_buf());
    ASKED.store(false, Ordering::Relaxed);
    let listening = LISTENING.get_or_init(|| {
        ctrlc::set_handler(|| {
            if ASKED.swap(true, Ordering::Relaxed) {
                let unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some(path) = unfinished.as_ref() {
                    // It has its own name and is not hidden once it is whole: then there is nothing to remove.
                    let _ = std::fs::remove_file(path);
                }
                // As a shell says that SIGINT ended it.
                std::process::exit(130);
            }
        })
        .map_err(|error| error.to_string())
    });
    (listening.clone())
        .map_err(|error| CommandError::Sentence(format!("Ctrl-C cannot be caught: {error}.")))
}

/// Returns true if the program has been asked to end since [`listen`].
pub(super) fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
