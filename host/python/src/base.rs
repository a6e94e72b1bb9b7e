//! Base parameters of a robot.

use pyo3::prelude::*;
use rig_identify::{Base, ModelKind};

use crate::array::shaped;
use crate::error::{Error, refused};
use crate::robot::Robot;

/// The combinations of parameters that motion and torque can identify.
#[pyclass(frozen, module = "rig_dynamics")]
pub(crate) struct BaseParameters {
    base: Base,
}

/// Reads the name of a model.
///
/// # Errors
/// An unknown name.
pub(crate) fn model_kind(name: &str) -> PyResult<ModelKind> {
    match name {
        "differential" => Ok(ModelKind::Differential),
        "integral" => Ok(ModelKind::Integral),
        _ => Err(Error::new_err(format!(
            "model is \"{name}\"; give \"differential\" or \"integral\"."
        ))),
    }
}

#[pymethods]
impl BaseParameters {
    /// Number of base parameters.
    #[getter]
    fn rank(&self) -> usize {
        self.base.len()
    }

    /// The combinations in the notation of the literature, such as ``Izz1 + Ia1``.
    #[getter]
    fn expressions(&self) -> Vec<String> {
        (0..self.base.len())
            .map(|row| self.base.expression(row))
            .collect()
    }

    /// Units of the base parameters, ASCII.
    #[getter]
    fn units(&self) -> Vec<&'static str> {
        (0..self.base.len())
            .map(|row| self.base.unit(row))
            .collect()
    }

    /// Column of the regressor that represents each base parameter.
    #[getter]
    fn columns(&self) -> Vec<usize> {
        self.base.columns.clone()
    }

    /// K in beta = K @ pi, shape (rank, 14 * links), or (rank, 17 * joints) with coupled drives.
    ///
    /// ``pi`` holds the standard parameters of the joints; with coupled drives the 3 parameters of each motor follow.
    #[getter]
    fn combination<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let matrix = &self.base.combination;
        // Column-major in memory: the transpose, read in that order, is row-major.
        let rows = matrix.transpose().as_slice().to_vec();
        shaped(py, rows, vec![matrix.nrows(), matrix.ncols()])
    }

    fn __len__(&self) -> usize {
        self.base.len()
    }

    fn __repr__(&self) -> String {
        format!("<BaseParameters: {}>", self.expressions().join(", "))
    }
}

/// Compute the base parameters from the numeric rank of the regressor at random states.
#[pyfunction]
#[pyo3(signature = (robot, model = "differential", *, seed = 1))]
pub(crate) fn base_parameters(
    py: Python<'_>,
    robot: &Robot,
    model: &str,
    seed: u64,
) -> PyResult<BaseParameters> {
    let (kind, description) = (model_kind(model)?, robot.description());
    let base = py
        .detach(|| Base::structural(&description.robot, kind, seed))
        .map_err(refused)?;
    Ok(BaseParameters { base })
}
