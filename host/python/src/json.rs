//! Results as Python objects, through the JSON that the program writes.

use pyo3::prelude::*;

/// Reads JSON text as dicts, lists, numbers and strings.
///
/// # Errors
/// Text that is not JSON.
pub(crate) fn read<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}

/// Returns the value of a key of a JSON object.
///
/// # Errors
/// Text that is not a JSON object with this key.
pub(crate) fn entry<'py>(py: Python<'py>, text: &str, key: &str) -> PyResult<Bound<'py, PyAny>> {
    read(py, text)?.get_item(key)
}
