//! NumPy arrays as signals: one row a sample, one column a joint.

use numpy::ndarray::{ArrayView2, Axis};
use numpy::{
    Element, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::error::Error;

/// A number that signals consist of: `f64` or `f32`.
pub(crate) trait Float: Element {
    /// NumPy's name of the type.
    const NAME: &'static str;
}

impl Float for f64 {
    const NAME: &'static str = "float64";
}

impl Float for f32 {
    const NAME: &'static str = "float32";
}

/// Returns true if all values are arrays of float32 of this machine.
pub(crate) fn are_single(values: &[&Bound<'_, PyAny>]) -> bool {
    (values.iter()).all(|value| value.cast::<PyArrayDyn<f32>>().is_ok())
}

/// A signal of all joints, borrowed from NumPy.
pub(crate) struct Signal<'py, T: Element> {
    array: PyReadonlyArrayDyn<'py, T>,
    name: &'static str,
    /// True if the array is one sample, of shape (joints,).
    single: bool,
}

/// Reads an array of shape (n, joints), or (joints,) for one sample.
///
/// An aligned array of `T` of any strides is read in place. Other arrays of real numbers, and lists, are copied to `T`.
///
/// # Errors
/// No array of numbers, or another shape.
pub(crate) fn signal<'py, T: Float>(
    name: &'static str,
    value: &Bound<'py, PyAny>,
    joints: usize,
) -> PyResult<Signal<'py, T>> {
    let array = floats(name, value)?;
    let shape = array.shape().to_vec();
    let single = match shape[..] {
        [width] if width == joints => true,
        [_, width] if width == joints => false,
        _ => {
            return Err(Error::new_err(format!(
                "{name} has shape {}; a robot with {joints} joint{} needs (n, {joints}) for n samples, or ({joints},) for one.",
                shown(&shape),
                if joints == 1 { "" } else { "s" },
            )));
        }
    };
    Ok(Signal {
        array,
        name,
        single,
    })
}

/// Borrows an array of `T` of any shape; copies what has another type.
///
/// # Errors
/// No array of real numbers.
pub(crate) fn floats<'py, T: Float>(
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    if let Ok(array) = value.cast::<PyArrayDyn<T>>()
        && array.getattr("flags")?.getattr("aligned")?.is_truthy()?
    {
        return borrowed(name, array);
    }
    let numbers = value.py().import("numpy")?;
    let array = numbers
        .call_method1("asarray", (value,))
        .map_err(|_| Error::new_err(not_numbers(name, value)))?;
    let kind = array.getattr("dtype")?.getattr("kind")?;
    if !["f", "i", "u"].contains(&kind.cast::<PyString>()?.to_cow()?.as_ref()) {
        return Err(Error::new_err(format!(
            "{name} has the type {}; give real numbers, best as float64, which is read without a copy.",
            array.getattr("dtype")?
        )));
    }
    let copy = numbers.call_method1("array", (array, T::NAME))?;
    borrowed(name, copy.cast::<PyArrayDyn<T>>()?)
}

fn not_numbers(name: &str, value: &Bound<'_, PyAny>) -> String {
    let kind = value
        .get_type()
        .name()
        .map_or_else(|_| "object".to_owned(), |name| name.to_string());
    format!("{name} is a {kind} from which NumPy makes no array; give an array of numbers.")
}

fn borrowed<'py, T: Element>(
    name: &str,
    array: &Bound<'py, PyArrayDyn<T>>,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    array
        .try_readonly()
        .map_err(|error| Error::new_err(format!("{name} cannot be read: {error}.")))
}

/// Writes a shape as Python does.
fn shown(shape: &[usize]) -> String {
    let list: Vec<String> = shape.iter().map(usize::to_string).collect();
    match list.as_slice() {
        [one] => format!("({one},)"),
        several => format!("({})", several.join(", ")),
    }
}

impl<T: Element> Signal<'_, T> {
    /// Returns the signal as rows of samples; one row for a single sample.
    ///
    /// # Errors
    /// None for a checked shape.
    pub(crate) fn rows(&self) -> PyResult<ArrayView2<'_, T>> {
        let all = self.array.as_array();
        let all = if self.single {
            all.insert_axis(Axis(0))
        } else {
            all
        };
        all.into_dimensionality()
            .map_err(|error| Error::new_err(format!("{} cannot be read: {error}.", self.name)))
    }
}

/// Checks that all signals have the shape of the first.
///
/// # Errors
/// A sentence with both shapes.
pub(crate) fn same_shape<T: Element>(signals: &[Signal<'_, T>]) -> PyResult<()> {
    let Some((first, others)) = signals.split_first() else {
        return Ok(());
    };
    match others
        .iter()
        .find(|other| other.array.shape() != first.array.shape())
    {
        Some(other) => Err(Error::new_err(format!(
            "{} has shape {}, but {} has shape {}; give both the same samples.",
            first.name,
            shown(first.array.shape()),
            other.name,
            shown(other.array.shape()),
        ))),
        None => Ok(()),
    }
}

/// Hands numbers in row-major order to NumPy, without a copy. `shape` is that of one sample; several samples have their
/// number before it.
///
/// # Errors
/// A shape that does not have as many numbers.
pub(crate) fn array<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    like: &Signal<'_, T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let mut whole = shape.to_vec();
    if !like.single {
        whole.insert(0, like.array.shape()[0]);
    }
    shaped(py, numbers, whole)
}

/// Hands numbers in row-major order to NumPy, without a copy.
///
/// # Errors
/// A shape that does not have as many numbers.
pub(crate) fn shaped<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: Vec<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, numbers).reshape(shape)?.into_any())
}
