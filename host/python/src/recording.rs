//! Recordings: files, or arrays that are written to a temporary file.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyMapping, PyTuple, PyType};
use rig::commands::CommandError;
use rig_data::{Block, Column, CsvWriter, EffortNeed, JointColumns, Source, column_names};
use rig_model::robot;
use tempfile::TempDir;

use crate::array::{floats, shaped};
use crate::error::{Error, raised_as, refused, warn};
use crate::robot::Robot;

/// A recording on disk.
pub(crate) struct RecordingFile {
    path: PathBuf,
    /// Name in messages, if the file is temporary.
    name: Option<String>,
    columns: Vec<String>,
    /// Removed together with the recording.
    _folder: Option<TempDir>,
}

impl RecordingFile {
    /// Opens a recording that stays where it is.
    ///
    /// # Errors
    /// A file that cannot be read or is no recording.
    fn at(path: PathBuf) -> PyResult<Self> {
        Ok(Self {
            columns: column_names(&path).map_err(refused)?,
            path,
            name: None,
            _folder: None,
        })
    }

    /// Makes a temporary recording called `name`; `write` fills the file of the given path.
    ///
    /// # Errors
    /// Those of `write`, and of a system without room for temporary files.
    pub(crate) fn temporary(
        name: &str,
        write: impl FnOnce(&Path) -> Result<(), CommandError>,
    ) -> Result<Self, CommandError> {
        let folder = tempfile::tempdir().map_err(|error| {
            CommandError::Sentence(format!(
                "No temporary file can be made for {name}: {error}."
            ))
        })?;
        let path = folder.path().join("recording.csv");
        let written = write(&path).and_then(|()| Ok(column_names(&path)?));
        Ok(Self {
            columns: written.map_err(|error| named(error, &path, name))?,
            path,
            name: Some(name.to_owned()),
            _folder: Some(folder),
        })
    }

    /// Returns the path of the file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Replaces the path of a temporary file by the name of the recording.
    pub(crate) fn shown(&self, text: &str) -> String {
        match &self.name {
            Some(name) => text.replace(&self.path.display().to_string(), name),
            None => text.to_owned(),
        }
    }

    /// Returns the name for messages.
    pub(crate) fn label(&self) -> String {
        self.shown(&self.path.display().to_string())
    }
}

/// Replaces the path of a temporary file in an error by the name of its recording.
fn named(error: CommandError, path: &Path, name: &str) -> CommandError {
    let (text, path) = (error.to_string(), path.display().to_string());
    match text.contains(&path) {
        true => CommandError::Sentence(text.replace(&path, name)),
        false => error,
    }
}

/// A recording of a robot's motion: a file, or arrays.
///
/// ``columns``: a mapping from names to arrays. ``t`` is the time in s, shape (n,). An array of shape (n,) is one column
/// of the names of docs/formats.md, such as ``q1`` or ``tau1``. An array of shape (n, joints) is one column a joint:
/// ``q`` becomes ``q1``, ``q2``, .... Columns are ``q`` (rad or m), ``tau`` (N*m or N) or ``i`` (motor current, A), and
/// optionally ``qd``, ``qdd``, ``ref``, ``u`` (V), ``temp`` (degrees Celsius) and others.
///
/// The arrays are written to a temporary CSV file at once, which loses no digit, so that they pass the same checks as a
/// file. A sentence about row ``line k`` means the sample with index k - 2. ``name`` is the name in such sentences.
#[pyclass(frozen, module = "rig_dynamics")]
pub(crate) struct Recording {
    file: Arc<RecordingFile>,
}

impl Recording {
    /// Wraps a file.
    pub(crate) fn of(file: RecordingFile) -> Self {
        Self {
            file: Arc::new(file),
        }
    }

    /// Returns the file, shared with work that runs without Python.
    pub(crate) fn file(&self) -> Arc<RecordingFile> {
        Arc::clone(&self.file)
    }
}

/// Reads one recording or several: a `Recording`, a path, a dict of columns, or a list of these.
///
/// # Errors
/// Another type, or a recording that cannot be read.
pub(crate) fn recordings(value: &Bound<'_, PyAny>) -> PyResult<Vec<Arc<RecordingFile>>> {
    if value.is_none() {
        return Ok(Vec::new());
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let mut all = Vec::new();
        for one in value.try_iter()? {
            all.push(recording(&one?)?);
        }
        return Ok(all);
    }
    Ok(vec![recording(value)?])
}

fn recording(value: &Bound<'_, PyAny>) -> PyResult<Arc<RecordingFile>> {
    if let Ok(recording) = value.cast::<Recording>() {
        return Ok(recording.get().file());
    }
    if let Ok(columns) = value.cast::<PyMapping>() {
        return Ok(Recording::new(value.py(), columns, "recording")?.file());
    }
    match value.extract::<PathBuf>() {
        Ok(path) => Ok(Arc::new(RecordingFile::at(path)?)),
        Err(_) => Err(Error::new_err(format!(
            "{value} is no recording; give a Recording, the path of a .csv or .mcap file, or a dict of columns."
        ))),
    }
}

/// A column of a recording to be written: its name, its array, and which column of the array it is.
struct Part<'py> {
    name: String,
    array: Rc<PyReadonlyArrayDyn<'py, f64>>,
    index: Option<usize>,
}

/// Reads the columns of a dict, the time first. An array of shape (n, joints) becomes one column a joint.
fn parts<'py>(columns: &Bound<'py, PyMapping>) -> PyResult<Vec<Part<'py>>> {
    let mut parts: Vec<Part<'py>> = Vec::new();
    for entry in columns.items()?.iter() {
        let (name, value): (String, Bound<'py, PyAny>) = entry.extract()?;
        let array = Rc::new(floats(&name, &value)?);
        match *array.shape() {
            [_] => parts.push(Part {
                name,
                array,
                index: None,
            }),
            [_, joints] if name != "t" => parts.extend((0..joints).map(|joint| Part {
                name: format!("{name}{}", joint + 1),
                array: Rc::clone(&array),
                index: Some(joint),
            })),
            _ => {
                return Err(Error::new_err(format!(
                    "Column {name} has {} dimensions; give (n,), or (n, joints) for one column a joint.",
                    array.ndim()
                )));
            }
        }
    }
    let Some(time) = parts.iter().position(|part| part.name == "t") else {
        return Err(Error::new_err(
            "The recording has no column t; give the time of each sample in s.".to_owned(),
        ));
    };
    parts.swap(0, time);
    parts[1..].sort_by(|a, b| a.name.cmp(&b.name));
    let rows = parts[0].array.shape()[0];
    match parts.iter().find(|part| part.array.shape()[0] != rows) {
        Some(part) => Err(Error::new_err(format!(
            "Column {} has {} samples, but t has {rows}; give all columns the same number.",
            part.name,
            part.array.shape()[0]
        ))),
        None => Ok(parts),
    }
}

/// Writes columns as CSV; every number reads back bit for bit.
///
/// # Errors
/// A number that is not finite, and errors of the system.
fn write(path: &Path, name: &str, parts: &[Part<'_>]) -> Result<(), CommandError> {
    let columns: Vec<Column> = parts
        .iter()
        .map(|part| Column::new(&part.name, ""))
        .collect();
    let mut writer = CsvWriter::create(path, &columns)?;
    let views: Vec<_> = (parts.iter())
        .map(|part| (part.array.as_array(), part.index))
        .collect();
    let rows = views.first().map_or(0, |(view, _)| view.shape()[0]);
    let mut row = vec![0.0; views.len()];
    for k in 0..rows {
        for (value, (view, index)) in row.iter_mut().zip(&views) {
            *value = match index {
                Some(joint) => view[[k, *joint]],
                None => view[[k]],
            };
        }
        if let Some(c) = row.iter().position(|value| !value.is_finite()) {
            return Err(CommandError::Sentence(format!(
                "Column {} of {name} is {} at the sample with index {k}, but a recording holds finite numbers only.",
                parts[c].name, row[c]
            )));
        }
        writer.push_row(&row)?;
    }
    Ok(writer.finish()?)
}

#[pymethods]
impl Recording {
    #[new]
    #[pyo3(signature = (columns, *, name = "recording"))]
    fn new(_py: Python<'_>, columns: &Bound<'_, PyMapping>, name: &str) -> PyResult<Self> {
        let parts = parts(columns)?;
        RecordingFile::temporary(name, |path| write(path, name, &parts))
            .map(Self::of)
            .map_err(refused)
    }

    /// Open a recording, CSV or MCAP. Its rows are read only when they are used.
    #[classmethod]
    fn load(_class: &Bound<'_, PyType>, path: PathBuf) -> PyResult<Self> {
        RecordingFile::at(path).map(Self::of)
    }

    /// Path of the file, or name of the arrays.
    #[getter]
    fn name(&self) -> String {
        self.file.label()
    }

    /// Names of the columns, as the file has them; ``t`` alone for ROS 2, whose other columns are joints of a robot.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.file.columns.clone()
    }

    /// Return the columns as joint-side signals in SI units.
    ///
    /// ``t`` has the shape (n,); ``q`` and, if recorded, ``tau``, ``qd``, ``qdd``, ``ref``, ``u``, ``temp`` and ``ql``
    /// have the shape (n, joints). Motor currents become torques by the robot's drives. NaN stands for a joint without
    /// that column.
    fn read<'py>(&self, py: Python<'py>, robot: &Robot) -> PyResult<Bound<'py, PyDict>> {
        let description = robot.description();
        let (blocks, warnings) = py
            .detach(|| blocks(&self.file.path, &description.robot))
            .map_err(|error| raised_as(&error, self.file.shown(&error.to_string())))?;
        warn(py, &warnings)?;
        signals(py, &blocks, description.robot.joints.len())
    }

    fn __repr__(&self) -> String {
        format!("<Recording {}: {}>", self.name(), self.columns().join(", "))
    }
}

/// Reads all rows and the warnings about them.
fn blocks(path: &Path, robot: &robot::Robot) -> Result<(Vec<Block>, Vec<String>), CommandError> {
    let source = Source::open_with(path, robot, EffortNeed::Optional)?;
    let (blocks, warnings) = source.read_all()?;
    Ok((blocks, warnings.iter().map(ToString::to_string).collect()))
}

/// A column of one joint in a block, if recorded.
type Pick = fn(&JointColumns) -> Option<&Vec<f64>>;

/// Joins blocks into arrays.
fn signals<'py>(py: Python<'py>, blocks: &[Block], joints: usize) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let t: Vec<f64> = blocks.iter().flat_map(|block| block.t.clone()).collect();
    let rows = t.len();
    dict.set_item("t", shaped(py, t, vec![rows])?)?;
    let all: [(&str, Pick); 8] = [
        ("q", |joint| Some(&joint.q)),
        ("qd", |joint| joint.qd.as_ref()),
        ("qdd", |joint| joint.qdd.as_ref()),
        ("tau", |joint| {
            Some(&joint.tau).filter(|tau| !tau.is_empty())
        }),
        ("ref", |joint| joint.reference.as_ref()),
        ("u", |joint| joint.voltage.as_ref()),
        ("temp", |joint| joint.temperature.as_ref()),
        ("ql", |joint| joint.link.as_ref()),
    ];
    for (name, pick) in all {
        let mut numbers = vec![f64::NAN; rows * joints];
        let (mut first, mut recorded) = (0, false);
        for block in blocks {
            for (j, joint) in block.joints.iter().enumerate() {
                for (k, value) in pick(joint).into_iter().flatten().enumerate() {
                    numbers[(first + k) * joints + j] = *value;
                    recorded = true;
                }
            }
            first += block.len();
        }
        if recorded {
            dict.set_item(name, shaped(py, numbers, vec![rows, joints])?)?;
        }
    }
    Ok(dict)
}
