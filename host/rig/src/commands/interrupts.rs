//! Ctrl-C and the signals that end a program, during a recording.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use super::error::CommandError;

/// True if the program has been asked to end since the recording began.
static ASKED: AtomicBool = AtomicBool::new(false);
/// The file that is being written under a hidden name.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Handles Ctrl-C, SIGTERM and SIGHUP from now on. After the first request the link comes to rest, the recorded samples
/// are kept and the program ends. After the second request the program removes `unfinished` and ends at once; the rig
/// then stops by itself because the communication has ended.
///
/// # Errors
/// [`CommandError::Sentence`] if the system does not allow a handler.
pub(super) fn listen(unfinished: Option<&Path>) -> Result<(), CommandError> {
    // A process has one handler, but a process that uses this library may record more than once.
    static LISTENING: OnceLock<Result<(), String>> = OnceLock::new();
    writing(unfinished);
    ASKED.store(false, Ordering::Relaxed);
    let listening = LISTENING.get_or_init(|| {
        ctrlc::set_handler(|| {
            if ASKED.swap(true, Ordering::Relaxed) {
                let unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some(path) = unfinished.as_ref() {
                    // A complete file has been renamed: then there is no file of this name to remove.
                    let _ = std::fs::remove_file(path);
                }
                // The exit status that a shell gives for a program ended by SIGINT.
                std::process::exit(130);
            }
        })
        .map_err(|error| error.to_string())
    });
    (listening.clone())
        .map_err(|error| CommandError::Sentence(format!("Ctrl-C cannot be caught: {error}.")))
}

/// Lets the next request end the program at once, after a recording.
pub(super) fn end_at_once() {
    writing(None);
    ASKED.store(true, Ordering::Relaxed);
}

/// Replaces the file that is being written.
pub(super) fn writing(unfinished: Option<&Path>) {
    *UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner) = unfinished.map(Path::to_path_buf);
}

/// Returns true if the program has been asked to end since [`listen`].
pub(super) fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
