//! Designed motions.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rig::commands::{CommandError, refuse_file};
use rig_excite::{Design, TrajectoryFile};
use rig_model::robot::Description;

use crate::array::shaped;
use crate::error::refused;

/// A motion from rest to rest, made by :func:`excite`.
#[pyclass(frozen, module = "rig_dynamics")]
pub(crate) struct Trajectory {
    design: Design,
    description: Arc<Description>,
}

impl Trajectory {
    /// Keeps a design together with the robot that it is for.
    pub(crate) fn of(design: Design, description: Arc<Description>) -> Self {
        Self {
            design,
            description,
        }
    }

    /// Returns the motion.
    pub(crate) fn file(&self) -> TrajectoryFile {
        self.design.file.clone()
    }
}

#[pymethods]
impl Trajectory {
    /// Duration, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.design.file.duration()
    }

    /// Condition number of the regressor with columns scaled to their sizes; below 100 is good.
    #[getter]
    fn condition_number(&self) -> f64 {
        self.design.values.condition_number
    }

    /// The parameters that the motion makes identifiable.
    #[getter]
    fn base_parameters(&self) -> Vec<String> {
        self.design.base_parameters.clone()
    }

    /// Sentences; also issued as :class:`Remark`.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.design.notes.clone()
    }

    /// Return ``t`` (n,), ``q``, ``qd`` and ``qdd`` (n, joints) at ``rate`` Hz.
    #[pyo3(signature = (rate = 1000.0))]
    fn sample<'py>(&self, py: Python<'py>, rate: f64) -> PyResult<Bound<'py, PyDict>> {
        let sampled = self.design.file.sampled(rate).map_err(refused)?;
        let rows = sampled.position.first().map_or(0, Vec::len);
        let dict = PyDict::new(py);
        let t: Vec<f64> = (0..rows).map(|k| k as f64 * sampled.period).collect();
        dict.set_item("t", shaped(py, t, vec![rows])?)?;
        for (name, columns) in [
            ("q", &sampled.position),
            ("qd", &sampled.velocity),
            ("qdd", &sampled.acceleration),
        ] {
            let by_row = (0..rows).flat_map(|k| columns.iter().map(move |column| column[k]));
            let numbers: Vec<f64> = by_row.collect();
            dict.set_item(name, shaped(py, numbers, vec![rows, columns.len()])?)?;
        }
        Ok(dict)
    }

    /// Write the motion: .toml holds its parameters (for the rig), .csv its samples at ``rate`` Hz.
    #[pyo3(signature = (path, *, rate = 1000.0, force = false))]
    fn save(&self, path: PathBuf, rate: f64, force: bool) -> PyResult<()> {
        let save = || -> Result<(), CommandError> {
            refuse_file(&path, force)?;
            Ok((self.design.file).save(&path, &self.description.robot, rate)?)
        };
        save().map_err(refused)
    }

    fn __repr__(&self) -> String {
        format!(
            "<Trajectory of {:.1} s, condition number {:.1}>",
            self.duration(),
            self.condition_number()
        )
    }
}
