//! Errors as Python exceptions, remarks as Python warnings.

use std::error::Error as _;
use std::ffi::CString;
use std::io;

use pyo3::create_exception;
use pyo3::exceptions::{PyFileExistsError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use rig::commands::CommandError;

create_exception!(
    rig_dynamics,
    Error,
    PyValueError,
    "Input that cannot be used. The text is one sentence with the file, line or value at fault and what would be right.\n\nFiles that the system refuses raise ``OSError`` or one of its subclasses instead."
);
create_exception!(
    rig_dynamics,
    Remark,
    PyUserWarning,
    "An assumption, or something in the input that looks wrong but does not stop the work."
);

/// Makes the exception of an error: `OSError` or a subclass if the system refused a file, [`Error`] otherwise.
pub(crate) fn raised(error: &CommandError) -> PyErr {
    raised_as(error, error.to_string())
}

/// As [`raised`], with another text.
pub(crate) fn raised_as(error: &CommandError, text: String) -> PyErr {
    if matches!(
        error,
        CommandError::Exists { .. } | CommandError::Results { .. }
    ) {
        return PyFileExistsError::new_err(text);
    }
    let mut cause = error.source();
    while let Some(inner) = cause {
        if let Some(refused) = inner.downcast_ref::<io::Error>() {
            return io::Error::new(refused.kind(), text).into();
        }
        cause = inner.source();
    }
    Error::new_err(text)
}

/// Makes the exception of any error that becomes a [`CommandError`].
pub(crate) fn refused<E: Into<CommandError>>(error: E) -> PyErr {
    raised(&error.into())
}

/// Issues each sentence as a warning of the category [`Remark`].
///
/// # Errors
/// The warning itself, if the user's filters turn warnings into exceptions.
pub(crate) fn warn<'a>(
    py: Python<'_>,
    sentences: impl IntoIterator<Item = &'a String>,
) -> PyResult<()> {
    let category = py.get_type::<Remark>();
    for sentence in sentences {
        // A C string ends at a zero byte, which no sentence has.
        let text = CString::new(sentence.replace('\0', "")).unwrap_or_default();
        PyErr::warn(py, &category, &text, 1)?;
    }
    Ok(())
}
