//! Identification of a load at the flange.

use std::path::PathBuf;
use std::sync::Arc;

use clap::ValueEnum;
use pyo3::prelude::*;
use rig::commands::{CommandError, Inputs, LoadRequest, Measured, ReadsArg, load_json, write_load};
use rig_data::Mapping;
use rig_model::robot::{Description, Original};

use crate::array::shaped;
use crate::error::{Error, refused, warn};
use crate::inputs::{Files, argument, checked, paths, shown};
use crate::json;
use crate::recording::recordings;
use crate::robot::Robot;
use crate::watch::run;

/// The result of :func:`identify_load`, in the flange frame. ``to_dict()`` has the keys of ``load.json`` (docs/load.md).
#[pyclass(frozen, module = "rig_dynamics")]
pub(crate) struct LoadIdentification {
    found: rig_load::LoadIdentification,
    description: Arc<Description>,
    json: String,
    /// Warnings from reading the recordings, for the report.
    warnings: Vec<String>,
    command: String,
}

impl LoadIdentification {
    fn flange(&self) -> Option<&str> {
        self.description.urdf.as_ref().map(Original::tip)
    }
}

/// Places of Ixx Ixy Ixz Iyy Iyz Izz in a symmetric matrix, row by row.
const SYMMETRIC: [usize; 9] = [0, 1, 2, 1, 3, 4, 2, 4, 5];

#[pymethods]
impl LoadIdentification {
    /// Mass, kg.
    #[getter]
    fn mass(&self) -> f64 {
        self.found.mass.value
    }

    /// Standard deviation of the mass, kg.
    #[getter]
    fn mass_std(&self) -> f64 {
        self.found.mass.std
    }

    /// Centre of mass, m, shape (3,).
    #[getter]
    fn centre<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        shaped(py, self.found.centre.map(|own| own.value).to_vec(), vec![3])
    }

    /// Standard deviations of the centre of mass, m, shape (3,).
    #[getter]
    fn centre_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        shaped(py, self.found.centre.map(|own| own.std).to_vec(), vec![3])
    }

    /// Inertia about the centre of mass in the axes of the flange, kg*m^2, shape (3, 3).
    #[getter]
    fn inertia<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let entries = SYMMETRIC.map(|k| self.found.inertia[k].value);
        shaped(py, entries.to_vec(), vec![3, 3])
    }

    /// Standard deviations of the inertia, kg*m^2, shape (3, 3).
    #[getter]
    fn inertia_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let entries = SYMMETRIC.map(|k| self.found.inertia[k].std);
        shaped(py, entries.to_vec(), vec![3, 3])
    }

    /// m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz; the inertia about the flange's origin; SI, shape (10,).
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let values: Vec<f64> = (self.found.parameters.iter())
            .map(|own| own.value.value)
            .collect();
        let count = values.len();
        shaped(py, values, vec![count])
    }

    /// Covariance of ``parameters``, shape (10, 10).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.found.covariance.len();
        shaped(py, self.found.covariance.concat(), vec![rows, rows])
    }

    /// Names of the parameters that the data show.
    #[getter]
    fn shown(&self) -> Vec<&'static str> {
        let all = self.found.parameters.iter();
        all.filter(|own| own.shown).map(|own| own.name).collect()
    }

    /// What the data do not show: ``parameters``, ``experiment``, ``pose``.
    #[getter]
    fn not_shown(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(json::entry(py, &self.json, "not_shown")?.unbind())
    }

    /// Sentences; also issued as :class:`Remark`.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.found.warnings.clone()
    }

    /// Return the contents of ``load.json``.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::read(py, &self.json)
    }

    /// Write load.toml, load.urdf, load.json and report.html.
    ///
    /// A folder with earlier results is refused unless ``force``.
    #[pyo3(signature = (folder, *, force = false))]
    fn save(&self, py: Python<'_>, folder: PathBuf, force: bool) -> PyResult<()> {
        py.detach(|| {
            let told = (self.command.clone(), self.warnings.clone());
            write_load(&folder, &self.found, self.flange(), told, force)
        })
        .map_err(refused)
    }

    fn __repr__(&self) -> String {
        let mass = rig_output::format_value(self.found.mass.value, self.found.mass.std);
        format!("<LoadIdentification: {mass} kg>")
    }
}

/// Reads one of the names of an option.
fn named<T: ValueEnum>(option: &str, name: &str) -> PyResult<T> {
    T::from_str(name, false).map_err(|_| {
        let names: Vec<String> = (T::value_variants().iter())
            .filter_map(|own| Some(format!("\"{}\"", own.to_possible_value()?.get_name())))
            .collect();
        Error::new_err(format!(
            "{option} is \"{name}\"; give one of {}.",
            names.join(", ")
        ))
    })
}

/// What the work finds: the result, warnings from the headers for the report, and remarks.
type Found = (rig_load::LoadIdentification, Vec<String>, Vec<String>);

/// Identifies the load.
fn identified(request: &LoadRequest, description: &Description) -> Result<Found, CommandError> {
    request.check()?;
    let (mut robot, urdf) = (description.robot.clone(), description.urdf.as_ref());
    let inputs = request.open(&mut robot, Mapping::default())?;
    let warnings: Vec<String> = inputs.iter().flat_map(Inputs::warnings).collect();
    let mut remarks = warnings.clone();
    let found = request.identify((&robot, urdf), &inputs, |both| {
        remarks.extend(checked(&robot, both, Vec::new(), request.even_if_wrong)?);
        Ok(())
    })?;
    Ok((found, warnings, remarks))
}

/// The call that repeats an identification, for the report.
fn command(request: &LoadRequest, data: &Files, without: &Files) -> String {
    let by = request.by.to_possible_value();
    format!(
        "rig_dynamics.identify_load(robot, {}, {}, by=\"{}\")",
        argument(data),
        argument(without),
        by.as_ref().map_or("", |own| own.get_name())
    )
}

/// Identify a load at the flange, as ``rig load``.
///
/// ``data``: recordings with the load; ``without``: recordings without it. Each is a :class:`Recording`, a path, a dict of
/// columns, or a list of these. ``by``: "sensor" for the columns fx fy fz (N) and mx my mz (N*m) of a wrist sensor, in its
/// axes; "torque" for the joint torques; "both". ``poses``: every row is a pose at rest. ``subtract``: load.toml of a known
/// load that is mounted as well. ``mass``, ``mass_std``: the mass as weighed, kg; it enters no fit.
/// ``sensor_position``, ``sensor_rotation``: pose of the sensor in the flange frame, m and rad (roll, pitch, yaw);
/// ``reads``: "load" for the wrench of the load on the robot, "robot" for its opposite; ``gain_std``: relative standard
/// deviation of the sensor's gains. None takes each from the description. ``cutoff``: low-pass on the position, Hz.
/// ``even_if_wrong``: go on with the best explanation if channels look wrong.
///
/// Ctrl-C ends the call at once. Raises ``Error`` or ``OSError``.
#[pyfunction]
#[pyo3(signature = (
    robot, data, without = None, *, by = "sensor", poses = false, subtract = None, mass = None, mass_std = 0.0,
    sensor_position = None, sensor_rotation = None, reads = None, gain_std = None, cutoff = None, even_if_wrong = false,
))]
pub(crate) fn identify_load(
    py: Python<'_>,
    robot: &Robot,
    data: &Bound<'_, PyAny>,
    without: Option<&Bound<'_, PyAny>>,
    by: &str,
    poses: bool,
    subtract: Option<PathBuf>,
    mass: Option<f64>,
    mass_std: f64,
    sensor_position: Option<Vec<f64>>,
    sensor_rotation: Option<Vec<f64>>,
    reads: Option<&str>,
    gain_std: Option<f64>,
    cutoff: Option<f64>,
    even_if_wrong: bool,
) -> PyResult<LoadIdentification> {
    let description = robot.description();
    let data = recordings(data)?;
    let without = without.map_or_else(|| Ok(Vec::new()), recordings)?;
    let request = LoadRequest {
        data: paths(&data),
        without: paths(&without),
        by: named::<Measured>("by", by)?,
        poses,
        subtract,
        mass,
        mass_std,
        gain_std,
        sensor_position,
        sensor_rotation,
        reads: reads
            .map(|own| named::<ReadsArg>("reads", own))
            .transpose()?,
        cutoff,
        even_if_wrong,
    };
    let command = command(&request, &data, &without);
    let name = |text: String| shown(&[&data, &without], &text);
    let theirs = Arc::clone(&description);
    let (mut found, warnings, remarks) =
        run(py, None, &name, move |_| identified(&request, &theirs))?;
    let renamed = |list: Vec<String>| -> Vec<String> { list.into_iter().map(name).collect() };
    found.warnings = renamed(found.warnings);
    warn(py, &renamed(remarks))?;
    warn(py, &found.warnings)?;
    let flange = description.urdf.as_ref().map(Original::tip);
    Ok(LoadIdentification {
        json: load_json(&found, flange).map_err(refused)?,
        found,
        warnings: renamed(warnings),
        description,
        command,
    })
}
