//! The robot: description, names, parameters and dynamics.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PySlice, PyType};
use rig::commands::{CommandError, refuse_file};
use rig_identify::{chain_of, column_name, unit};
use rig_model::batch::{BatchError, Number};
use rig_model::robot::{self, Description};
use rig_output::write_whole;
use rig_shared::multibody::COLUMNS;

use crate::array::{Float, are_single, array, same_shape, shaped, signal};
use crate::dynamics::{Dynamics, Quantity};
use crate::error::{Error, refused, warn};

/// A robot description with its dynamics.
///
/// The dynamics are those of the rigid links with drive inertia, viscous and Coulomb friction and a constant torque:
///
///     tau = A(q) qdd + C(q, qd) qd + g(q) + Ia qdd + fv qd + fc sgn(qd) + off
///
/// They leave out the effects of the description (:attr:`effects`), and the torques by which coupled drives and ball
/// screws act between joints; :func:`simulate` has both.
///
/// Arrays have the shape (n, joints), or (joints,) for one sample. The unit of a position is rad for a revolute joint and
/// m for a prismatic one; the unit of a torque is N*m or N. Aligned float64 arrays of any strides are read in place,
/// without a copy. If all arrays of a call are float32, they are read in place too, the dynamics are computed in float32,
/// and the results are float32. Lists and arrays of other real numbers, and float32 beside float64, are copied to float64.
/// Other Python threads run during the computation. ``threads`` is the number of threads; 0 uses all processors, and the
/// result does not depend on it.
#[pyclass(frozen, module = "rig_dynamics")]
pub(crate) struct Robot {
    description: Arc<Description>,
    double: Dynamics<f64>,
    single: Dynamics<f32>,
}

/// A named argument.
type Argument<'a, 'py> = (&'static str, &'a Bound<'py, PyAny>);

impl Robot {
    /// Prepares the dynamics of a description.
    ///
    /// # Errors
    /// Geometry that is not a chain.
    pub(crate) fn of(description: Description) -> PyResult<Self> {
        let chain = chain_of(&description.robot).map_err(refused)?;
        let parameters = description.robot.standard_parameters();
        Ok(Self {
            double: Dynamics::new(&chain, &parameters).map_err(failed)?,
            single: Dynamics::new(&chain, &parameters).map_err(failed)?,
            description: Arc::new(description),
        })
    }

    /// Prepares the dynamics of a robot that is a result.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub(crate) fn of_result(robot: robot::Robot) -> PyResult<Self> {
        Self::of(Description {
            robot,
            urdf: None,
            remarks: Vec::new(),
            notes: Vec::new(),
        })
    }

    /// Returns the description, shared with work that runs without Python.
    pub(crate) fn description(&self) -> Arc<Description> {
        Arc::clone(&self.description)
    }

    fn robot(&self) -> &robot::Robot {
        &self.description.robot
    }

    fn joint_count(&self) -> usize {
        self.robot().joints.len()
    }

    /// Computes a quantity of signals of the same samples, in single precision if all of them are.
    fn computed<'py>(
        &self,
        py: Python<'py>,
        quantity: Quantity,
        arguments: &[Argument<'_, 'py>],
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values: Vec<_> = arguments.iter().map(|(_, value)| *value).collect();
        if are_single(&values) {
            self.computed_in(&self.single, py, quantity, arguments, threads)
        } else {
            self.computed_in(&self.double, py, quantity, arguments, threads)
        }
    }

    fn computed_in<'py, T: Float + Number>(
        &self,
        dynamics: &Dynamics<T>,
        py: Python<'py>,
        quantity: Quantity,
        arguments: &[Argument<'_, 'py>],
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let signals = (arguments.iter())
            .map(|(name, value)| signal::<T>(name, value, self.joint_count()))
            .collect::<PyResult<Vec<_>>>()?;
        same_shape(&signals)?;
        let rows = (signals.iter())
            .map(|own| own.rows())
            .collect::<PyResult<Vec<_>>>()?;
        let out = py
            .detach(|| dynamics.computed(quantity, &rows, threads))
            .map_err(failed)?;
        array(py, out, &signals[0], &dynamics.shape(quantity))
    }
}

/// The derivatives by three arguments.
type Matrices<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// Returns the three matrices of each sample as views of one array.
fn three_matrices(all: Bound<'_, PyAny>) -> PyResult<Matrices<'_>> {
    let py = all.py();
    let whole = PySlice::full(py);
    let view = |k: usize| all.get_item((py.Ellipsis(), k, &whole, &whole));
    Ok((view(0)?, view(1)?, view(2)?))
}

/// Makes the exception of a batch.
fn failed(error: BatchError) -> PyErr {
    Error::new_err(error.to_string())
}

/// Makes a robot of text and issues the remarks about it.
fn from_text(py: Python<'_>, robot: Result<robot::Robot, robot::RobotError>) -> PyResult<Robot> {
    let robot = robot.map_err(refused)?;
    let mut remarks = robot.implausible_bodies(None);
    remarks.extend(robot.limits_in_degrees());
    remarks.extend(robot.unlikely_values());
    warn(py, &remarks)?;
    Robot::of(Description {
        robot,
        urdf: None,
        remarks,
        notes: Vec::new(),
    })
}

#[pymethods]
impl Robot {
    /// Read a description, TOML or URDF. Its remarks are issued as :class:`Remark`.
    ///
    /// Raises ``Error`` with the line of the fault, or ``OSError``.
    #[classmethod]
    fn load(_class: &Bound<'_, PyType>, py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let description = Description::load(&path).map_err(refused)?;
        warn(py, &description.remarks)?;
        Self::of(description)
    }

    /// Read a description from TOML text.
    #[classmethod]
    fn from_toml(_class: &Bound<'_, PyType>, py: Python<'_>, text: &str) -> PyResult<Self> {
        from_text(py, robot::Robot::from_toml(text, Path::new("text")))
    }

    /// Read a description from URDF text.
    #[classmethod]
    fn from_urdf(_class: &Bound<'_, PyType>, py: Python<'_>, text: &str) -> PyResult<Self> {
        from_text(py, robot::Robot::from_urdf(text, Path::new("text")))
    }

    /// Return a description that ``rig init`` writes: one-link, edda, irp6, emps, tx40, double-pendulum or xl330.
    #[classmethod]
    fn template(_class: &Bound<'_, PyType>, py: Python<'_>, name: &str) -> PyResult<Self> {
        let Some(text) = robot::template(name) else {
            return Err(Error::new_err(format!(
                "\"{name}\" is no template; give one-link, edda, irp6, emps, tx40, double-pendulum or xl330."
            )));
        };
        from_text(py, robot::Robot::from_toml(text, Path::new(name)))
    }

    /// Name of the robot.
    #[getter]
    fn name(&self) -> &str {
        &self.robot().name
    }

    /// Names of the joints, from the base outwards.
    #[getter]
    fn joints(&self) -> Vec<&str> {
        (self.robot().joints.iter())
            .map(|joint| joint.name.as_str())
            .collect()
    }

    /// What looks unlikely in the description, one sentence each.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.description.remarks.clone()
    }

    /// Names of the effects beyond the standard model. The dynamics of this class leave them out.
    #[getter]
    fn effects(&self) -> Vec<String> {
        let effects = self.robot().effects.iter();
        effects.map(robot::RobotEffect::title).collect()
    }

    /// The standard parameters, shape (links, 14), the links of the joints before those of followers: m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz, Ia, fv, fc, off.
    ///
    /// Inertia is about the origin of the joint's frame (modified Denavit-Hartenberg); 0 for values that are not stated.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.robot().standard_parameters();
        shaped(py, rows.concat(), vec![rows.len(), COLUMNS])
    }

    /// Names of the columns of :meth:`regressor`, with the number of the link: 14 * links names.
    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        let links = self.robot().link_count();
        (0..links * COLUMNS)
            .map(|c| column_name(c, links))
            .collect()
    }

    /// Units of the columns of :meth:`regressor`, ASCII: 14 * links units.
    #[getter]
    fn parameter_units(&self) -> Vec<&'static str> {
        let kinds = self.robot().link_kinds();
        let drives = self.robot().drive_kinds();
        (0..kinds.len() * COLUMNS)
            .map(|c| unit(c, &kinds, &drives))
            .collect()
    }

    /// Return the description as TOML with units in comments.
    fn to_toml(&self) -> PyResult<String> {
        self.robot().to_toml().map_err(refused)
    }

    /// Write the description as .toml or .urdf. An existing file is replaced only with ``force``.
    #[pyo3(signature = (path, *, force = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        refuse_file(&path, force).map_err(refused)?;
        let extension = path.extension().and_then(|end| end.to_str());
        let text = match extension {
            Some("toml") => self.to_toml()?,
            Some("urdf") => {
                let urdf = match &self.description.urdf {
                    Some(original) => original.with_values(self.robot()),
                    None => self.robot().to_urdf(),
                };
                let urdf = urdf.map_err(refused)?;
                warn(py, &urdf.remarks)?;
                urdf.text
            }
            _ => {
                return Err(refused(CommandError::Sentence(format!(
                    "{} has another extension; a description is written as .toml or .urdf.",
                    path.display()
                ))));
            }
        };
        write_whole(&path, text.as_bytes()).map_err(refused)
    }

    /// Return the torques of a motion, shape (n, joints), N*m or N.
    ///
    /// ``q``, ``qd``, ``qdd``: position, velocity and acceleration, (n, joints) or (joints,).
    #[pyo3(signature = (q, qd, qdd, *, threads = 0))]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        qdd: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = [("q", q), ("qd", qd), ("qdd", qdd)];
        self.computed(py, Quantity::Inverse, &arguments, threads)
    }

    /// Return the accelerations under the torques ``tau``, shape (n, joints), rad/s^2 or m/s^2.
    ///
    /// Raises ``Error`` with the first sample (from 0) whose mass matrix is not positive definite.
    #[pyo3(signature = (q, qd, tau, *, threads = 0))]
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = [("q", q), ("qd", qd), ("tau", tau)];
        self.computed(py, Quantity::Forward, &arguments, threads)
    }

    /// Return the derivatives of the torques of a motion by q, qd and qdd: three arrays of shape (n, joints, joints).
    ///
    /// Entry (i, j) is that of torque i by joint j. The third array is the mass matrix. Viscous friction takes part;
    /// Coulomb friction counts as constant.
    #[pyo3(signature = (q, qd, qdd, *, threads = 0))]
    fn inverse_dynamics_derivatives<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        qdd: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Matrices<'py>> {
        let arguments = [("q", q), ("qd", qd), ("qdd", qdd)];
        three_matrices(self.computed(py, Quantity::InverseDerivatives, &arguments, threads)?)
    }

    /// Return the derivatives of the accelerations by q, qd and tau: three arrays of shape (n, joints, joints).
    ///
    /// Entry (i, j) is that of acceleration i by joint j. The third array is the inverse of the mass matrix. Viscous
    /// friction takes part; Coulomb friction counts as constant. Raises ``Error`` as :meth:`forward_dynamics`.
    #[pyo3(signature = (q, qd, tau, *, threads = 0))]
    fn forward_dynamics_derivatives<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Matrices<'py>> {
        let arguments = [("q", q), ("qd", qd), ("tau", tau)];
        three_matrices(self.computed(py, Quantity::ForwardDerivatives, &arguments, threads)?)
    }

    /// Return the mass matrices with drive inertias on the diagonal, shape (n, joints, joints), kg*m^2, kg*m or kg.
    #[pyo3(signature = (q, *, threads = 0))]
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = [("q", q)];
        self.computed(py, Quantity::MassMatrix, &arguments, threads)
    }

    /// Return the torques that hold the links against gravity, shape (n, joints), N*m or N.
    #[pyo3(signature = (q, *, threads = 0))]
    fn gravity<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = [("q", q)];
        self.computed(py, Quantity::Gravity, &arguments, threads)
    }

    /// Return the regressor Y with tau = Y @ parameters.ravel(), shape (n, joints, 14 * links).
    ///
    /// :attr:`parameter_names` and :attr:`parameter_units` describe the columns.
    #[pyo3(signature = (q, qd, qdd, *, threads = 0))]
    fn regressor<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        qdd: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = [("q", q), ("qd", qd), ("qdd", qdd)];
        self.computed(py, Quantity::Regressor, &arguments, threads)
    }

    fn __repr__(&self) -> String {
        format!("<Robot {:?}: {}>", self.name(), self.joints().join(", "))
    }
}
