"""The native part of rig_dynamics. All quantities are in SI units and on the joint side."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Union, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "BaseParameter",
    "BaseParameters",
    "Diagnosis",
    "Error",
    "Identification",
    "JointFit",
    "LoadIdentification",
    "Recording",
    "Remark",
    "Robot",
    "Step",
    "Trajectory",
    "Value",
    "base_parameters",
    "diagnose",
    "excite",
    "identify",
    "identify_load",
    "simulate",
]

_Floats = NDArray[np.float64]
_Singles = NDArray[np.float32]
_Path = Union[str, "PathLike[str]"]
_Columns = Mapping[str, ArrayLike]
_OneRecording = Union["Recording", _Path, _Columns]
_Recordings = Union[_OneRecording, Sequence[_OneRecording]]
_Progress = Callable[[float], object]
_Estimator = Literal[
    "ols", "weighted", "robust", "iv", "output-error", "tls", "ml", "ridge", "consistent"
]

class Error(ValueError):
    """Input that cannot be used. The text is one sentence with the file, line or value at fault and what would be right.

    Files that the system refuses raise ``OSError`` or one of its subclasses instead.
    """

class Remark(UserWarning):
    """An assumption, or something in the input that looks wrong but does not stop the work."""

@final
class Robot:
    """A robot description with its dynamics.

    The dynamics are those of the rigid links with drive inertia, viscous and Coulomb friction and a constant torque:

        tau = A(q) qdd + C(q, qd) qd + g(q) + Ia qdd + fv qd + fc sgn(qd) + off

    They leave out the effects of the description (:attr:`effects`), and the torques by which coupled drives and ball
    screws act between joints; :func:`simulate` has both.

    Arrays have the shape (n, joints), or (joints,) for one sample. The unit of a position is rad for a revolute joint and
    m for a prismatic one; the unit of a torque is N*m or N. Aligned float64 arrays of any strides are read in place,
    without a copy. If all arrays of a call are float32, they are read in place too, the dynamics are computed in float32,
    and the results are float32. Lists and arrays of other real numbers, and float32 beside float64, are copied to float64.
    Other Python threads run during the computation. ``threads`` is the number of threads; 0 uses all processors, and the
    result does not depend on it.
    """

    @classmethod
    def load(cls, path: _Path) -> Robot:
        """Read a description, TOML or URDF. Its remarks are issued as :class:`Remark`.

        Raises ``Error`` with the line of the fault, or ``OSError``.
        """

    @classmethod
    def from_toml(cls, text: str) -> Robot:
        """Read a description from TOML text."""

    @classmethod
    def from_urdf(cls, text: str) -> Robot:
        """Read a description from URDF text."""

    @classmethod
    def template(cls, name: str) -> Robot:
        """Return a description that ``rig init`` writes: one-link, edda, irp6, emps, tx40, double-pendulum or xl330."""

    @property
    def name(self) -> str:
        """Name of the robot."""

    @property
    def joints(self) -> list[str]:
        """Names of the joints, from the base outwards."""

    @property
    def remarks(self) -> list[str]:
        """What looks unlikely in the description, one sentence each."""

    @property
    def effects(self) -> list[str]:
        """Names of the effects beyond the standard model. The dynamics of this class leave them out."""

    @property
    def parameters(self) -> _Floats:
        """The standard parameters, shape (links, 14), the links of the joints before those of followers: m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz, Ia, fv, fc, off.

        Inertia is about the origin of the joint's frame (modified Denavit-Hartenberg); 0 for values that are not stated.
        """

    @property
    def parameter_names(self) -> list[str]:
        """Names of the columns of :meth:`regressor`, with the number of the link: 14 * links names."""

    @property
    def parameter_units(self) -> list[str]:
        """Units of the columns of :meth:`regressor`, ASCII: 14 * links units."""

    def to_toml(self) -> str:
        """Return the description as TOML with units in comments."""

    def save(self, path: _Path, *, force: bool = False) -> None:
        """Write the description as .toml or .urdf. An existing file is replaced only with ``force``."""

    @overload
    def inverse_dynamics(self, q: _Singles, qd: _Singles, qdd: _Singles, *, threads: int = 0) -> _Singles: ...  # type: ignore[overload-overlap]
    @overload
    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, threads: int = 0) -> _Floats:
        """Return the torques of a motion, shape (n, joints), N*m or N.

        ``q``, ``qd``, ``qdd``: position, velocity and acceleration, (n, joints) or (joints,).
        """

    @overload
    def forward_dynamics(self, q: _Singles, qd: _Singles, tau: _Singles, *, threads: int = 0) -> _Singles: ...  # type: ignore[overload-overlap]
    @overload
    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, *, threads: int = 0) -> _Floats:
        """Return the accelerations under the torques ``tau``, shape (n, joints), rad/s^2 or m/s^2.

        Raises ``Error`` with the first sample (from 0) whose mass matrix is not positive definite.
        """

    @overload
    def inverse_dynamics_derivatives(  # type: ignore[overload-overlap]
        self, q: _Singles, qd: _Singles, qdd: _Singles, *, threads: int = 0
    ) -> tuple[_Singles, _Singles, _Singles]: ...
    @overload
    def inverse_dynamics_derivatives(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, threads: int = 0
    ) -> tuple[_Floats, _Floats, _Floats]:
        """Return the derivatives of the torques of a motion by q, qd and qdd: three arrays of shape (n, joints, joints).

        Entry (i, j) is that of torque i by joint j. The third array is the mass matrix. Viscous friction takes part;
        Coulomb friction counts as constant.
        """

    @overload
    def forward_dynamics_derivatives(  # type: ignore[overload-overlap]
        self, q: _Singles, qd: _Singles, tau: _Singles, *, threads: int = 0
    ) -> tuple[_Singles, _Singles, _Singles]: ...
    @overload
    def forward_dynamics_derivatives(
        self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, *, threads: int = 0
    ) -> tuple[_Floats, _Floats, _Floats]:
        """Return the derivatives of the accelerations by q, qd and tau: three arrays of shape (n, joints, joints).

        Entry (i, j) is that of acceleration i by joint j. The third array is the inverse of the mass matrix. Viscous
        friction takes part; Coulomb friction counts as constant. Raises ``Error`` as :meth:`forward_dynamics`.
        """

    @overload
    def mass_matrix(self, q: _Singles, *, threads: int = 0) -> _Singles: ...  # type: ignore[overload-overlap]
    @overload
    def mass_matrix(self, q: ArrayLike, *, threads: int = 0) -> _Floats:
        """Return the mass matrices with drive inertias on the diagonal, shape (n, joints, joints), kg*m^2, kg*m or kg."""

    @overload
    def gravity(self, q: _Singles, *, threads: int = 0) -> _Singles: ...  # type: ignore[overload-overlap]
    @overload
    def gravity(self, q: ArrayLike, *, threads: int = 0) -> _Floats:
        """Return the torques that hold the links against gravity, shape (n, joints), N*m or N."""

    @overload
    def regressor(self, q: _Singles, qd: _Singles, qdd: _Singles, *, threads: int = 0) -> _Singles: ...  # type: ignore[overload-overlap]
    @overload
    def regressor(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, threads: int = 0) -> _Floats:
        """Return the regressor Y with tau = Y @ parameters.ravel(), shape (n, joints, 14 * links).

        :attr:`parameter_names` and :attr:`parameter_units` describe the columns.
        """

@final
class BaseParameters:
    """The combinations of parameters that motion and torque can identify."""

    @property
    def rank(self) -> int:
        """Number of base parameters."""

    @property
    def expressions(self) -> list[str]:
        """The combinations in the notation of the literature, such as ``Izz1 + Ia1``."""

    @property
    def units(self) -> list[str]:
        """Units of the base parameters, ASCII."""

    @property
    def columns(self) -> list[int]:
        """Column of the regressor that represents each base parameter."""

    @property
    def combination(self) -> _Floats:
        """K in beta = K @ pi, shape (rank, 14 * links), or (rank, 17 * joints) with coupled drives.

        ``pi`` holds the standard parameters of the joints; with coupled drives the 3 parameters of each motor follow.
        """

    def __len__(self) -> int: ...

def base_parameters(
    robot: Robot, model: Literal["differential", "integral"] = "differential", *, seed: int = 1
) -> BaseParameters:
    """Compute the base parameters from the numeric rank of the regressor at random states."""

@final
class Recording:
    """A recording of a robot's motion: a file, or arrays.

    ``columns``: a mapping from names to arrays. ``t`` is the time in s, shape (n,). An array of shape (n,) is one column
    of the names of docs/formats.md, such as ``q1`` or ``tau1``. An array of shape (n, joints) is one column a joint:
    ``q`` becomes ``q1``, ``q2``, .... Columns are ``q`` (rad or m), ``tau`` (N*m or N) or ``i`` (motor current, A), and
    optionally ``qd``, ``qdd``, ``ref``, ``u`` (V), ``temp`` (degrees Celsius) and others.

    The arrays are written to a temporary CSV file at once, which loses no digit, so that they pass the same checks as a
    file. A sentence about row ``line k`` means the sample with index k - 2. ``name`` is the name in such sentences.
    """

    def __new__(cls, columns: _Columns, *, name: str = "recording") -> Recording: ...
    @classmethod
    def load(cls, path: _Path) -> Recording:
        """Open a recording, CSV or MCAP. Its rows are read only when they are used."""

    @property
    def name(self) -> str:
        """Path of the file, or name of the arrays."""

    @property
    def columns(self) -> list[str]:
        """Names of the columns, as the file has them; ``t`` alone for ROS 2, whose other columns are joints of a robot."""

    def read(self, robot: Robot) -> dict[str, _Floats]:
        """Return the columns as joint-side signals in SI units.

        ``t`` has the shape (n,); ``q`` and, if recorded, ``tau``, ``qd``, ``qdd``, ``ref``, ``u``, ``temp`` and ``ql``
        have the shape (n, joints). Motor currents become torques by the robot's drives. NaN stands for a joint without
        that column.
        """

@final
class BaseParameter:
    """An identified base parameter."""

    @property
    def expression(self) -> str:
        """The combination, such as ``Izz1 + Ia1``."""

    @property
    def value(self) -> float:
        """Value, SI."""

    @property
    def std(self) -> float:
        """Standard deviation; it allows for the correlation of the residuals."""

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval."""

    @property
    def relative_std_percent(self) -> float:
        """100 * std / abs(value)."""

    @property
    def unit(self) -> str:
        """Unit, ASCII."""

@final
class JointFit:
    """Residuals of a joint."""

    @property
    def name(self) -> str:
        """Name of the joint."""

    @property
    def train_residual_rms(self) -> float:
        """RMS of the torque residual, N*m or N; NaN if no row of the joint was usable."""

    @property
    def holdout_residual_rms(self) -> float | None:
        """The same on the hold-out; None without one."""

    @property
    def train_relative_error(self) -> float:
        """RMS of the residual over RMS of the torque."""

    @property
    def holdout_relative_error(self) -> float | None:
        """The same on the hold-out; None without one."""

@final
class Identification:
    """The result of :func:`identify`. The attributes are those of ``identification.json`` (docs/formats.md)."""

    @property
    def model(self) -> Literal["differential", "integral"]:
        """Equations that were fitted."""

    @property
    def estimator(self) -> str:
        """Name of the estimator."""

    @property
    def rank(self) -> int:
        """Number of base parameters that are identifiable from the data."""

    @property
    def condition_number(self) -> float:
        """Condition number of the regressor of these parameters."""

    @property
    def base_parameters(self) -> list[BaseParameter]:
        """The identified parameters."""

    @property
    def joints(self) -> list[JointFit]:
        """Residuals by joint."""

    @property
    def not_excited(self) -> list[dict[str, Any]]:
        """Combinations that the data do not determine: ``combination``, ``why``, ``motion``."""

    @property
    def standard_parameters(self) -> dict[str, Any] | None:
        """A full, physically consistent set of standard parameters; None for a single joint unless requested."""

    @property
    def comparison(self) -> dict[str, Any] | None:
        """Comparison of the estimators with the recommended one, if requested."""

    @property
    def procedure(self) -> list[str]:
        """The course of the estimation, sentences."""

    @property
    def warnings(self) -> list[str]:
        """Sentences; also issued as :class:`Remark`."""

    @property
    def robot(self) -> Robot:
        """The description with the identified values."""

    def to_dict(self) -> dict[str, Any]:
        """Return the contents of ``identification.json``."""

    def save(self, folder: _Path, *, force: bool = False) -> None:
        """Write identified.toml, identification.json, report.html and, with a full set of parameters, identified.urdf.

        A folder with earlier results is refused unless ``force``.
        """

def identify(
    robot: Robot,
    data: _Recordings,
    holdout: _Recordings | None = None,
    *,
    estimator: _Estimator | None = None,
    model: Literal["differential", "integral"] = "differential",
    compare: Literal["auto", "all"] | Sequence[_Estimator] | None = None,
    weights: Sequence[float] | None = None,
    prior_uncertainty: float | None = None,
    as_described: bool = False,
    cutoff: float | None = None,
    decimation: int | None = None,
    min_speed: float | None = None,
    window: float | None = None,
    torque_lead: float = 0.0,
    measured_derivatives: bool = False,
    even_if_wrong: bool = False,
    seed: int = 1,
    progress: _Progress | None = None,
) -> Identification:
    """Identify the parameters of a robot from recordings, as ``rig identify``.

    ``data``, ``holdout``: a :class:`Recording`, a path, a dict of columns, or a list of these.
    ``estimator``: None for weighted; for several joints consistent.
    ``compare``: estimators to compare by cross-validation; None for no comparison, "auto" as the program does.
    ``weights``: weight of each training recording; 1 if not given.
    ``cutoff``: low-pass on the position, Hz; ``decimation``: keep every n-th row; ``min_speed``: leave out slower rows,
    rad/s or m/s; None chooses each from the data. ``window``: of the integral model, s. ``torque_lead``: s.
    ``even_if_wrong``: fit although columns look wrong. ``progress``: called with the share of the work, 0 to 1.

    Ctrl-C ends the call at once. Raises ``Error`` or ``OSError``.
    """

@final
class LoadIdentification:
    """The result of :func:`identify_load`, in the flange frame. ``to_dict()`` has the keys of ``load.json`` (docs/load.md)."""

    @property
    def mass(self) -> float:
        """Mass, kg."""

    @property
    def mass_std(self) -> float:
        """Standard deviation of the mass, kg."""

    @property
    def centre(self) -> _Floats:
        """Centre of mass, m, shape (3,)."""

    @property
    def centre_std(self) -> _Floats:
        """Standard deviations of the centre of mass, m, shape (3,)."""

    @property
    def inertia(self) -> _Floats:
        """Inertia about the centre of mass in the axes of the flange, kg*m^2, shape (3, 3)."""

    @property
    def inertia_std(self) -> _Floats:
        """Standard deviations of the inertia, kg*m^2, shape (3, 3)."""

    @property
    def parameters(self) -> _Floats:
        """m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz; the inertia about the flange's origin; SI, shape (10,)."""

    @property
    def covariance(self) -> _Floats:
        """Covariance of ``parameters``, shape (10, 10)."""

    @property
    def shown(self) -> list[str]:
        """Names of the parameters that the data show."""

    @property
    def not_shown(self) -> list[dict[str, Any]]:
        """What the data do not show: ``parameters``, ``experiment``, ``pose``."""

    @property
    def warnings(self) -> list[str]:
        """Sentences; also issued as :class:`Remark`."""

    def to_dict(self) -> dict[str, Any]:
        """Return the contents of ``load.json``."""

    def save(self, folder: _Path, *, force: bool = False) -> None:
        """Write load.toml, load.urdf, load.json and report.html.

        A folder with earlier results is refused unless ``force``.
        """

def identify_load(
    robot: Robot,
    data: _Recordings,
    without: _Recordings | None = None,
    *,
    by: Literal["sensor", "torque", "both"] = "sensor",
    poses: bool = False,
    subtract: _Path | None = None,
    mass: float | None = None,
    mass_std: float = 0.0,
    sensor_position: Sequence[float] | None = None,
    sensor_rotation: Sequence[float] | None = None,
    reads: Literal["load", "robot"] | None = None,
    gain_std: float | None = None,
    cutoff: float | None = None,
    even_if_wrong: bool = False,
) -> LoadIdentification:
    """Identify a load at the flange, as ``rig load``.

    ``data``: recordings with the load; ``without``: recordings without it. Each is a :class:`Recording`, a path, a dict of
    columns, or a list of these. ``by``: "sensor" for the columns fx fy fz (N) and mx my mz (N*m) of a wrist sensor, in its
    axes; "torque" for the joint torques; "both". ``poses``: every row is a pose at rest. ``subtract``: load.toml of a known
    load that is mounted as well. ``mass``, ``mass_std``: the mass as weighed, kg; it enters no fit.
    ``sensor_position``, ``sensor_rotation``: pose of the sensor in the flange frame, m and rad (roll, pitch, yaw);
    ``reads``: "load" for the wrench of the load on the robot, "robot" for its opposite; ``gain_std``: relative standard
    deviation of the sensor's gains. None takes each from the description. ``cutoff``: low-pass on the position, Hz.
    ``even_if_wrong``: go on with the best explanation if channels look wrong.

    Ctrl-C ends the call at once. Raises ``Error`` or ``OSError``.
    """

@final
class Value:
    """A fitted number."""

    @property
    def value(self) -> float:
        """Value, SI."""

    @property
    def std(self) -> float:
        """Standard deviation; 0 for an integer, infinite if not identifiable."""

    @property
    def unit(self) -> str:
        """Unit, ASCII."""

@final
class Step:
    """An effect that was found."""

    @property
    def effect(self) -> str:
        """Most probable name."""

    @property
    def law(self) -> str | None:
        """Law, if the name has several."""

    @property
    def joint(self) -> str:
        """Name of the joint."""

    @property
    def set(self) -> list[str]:
        """All names that these data support equally, ``effect`` among them."""

    @property
    def parameters(self) -> dict[str, Value]:
        """Its parameters."""

    @property
    def p_value(self) -> float:
        """p-value, corrected for all trials."""

    @property
    def name_probability(self) -> float:
        """Posterior probability of the name among all tried in its place; NaN if no search compared them."""

    @property
    def runner_up(self) -> str | None:
        """Best name outside the set."""

    @property
    def train_rms(self) -> tuple[float, float]:
        """RMS of the joint's residual before and after this step, N*m or N (rad or m by voltage)."""

    @property
    def holdout_rms(self) -> tuple[float, float] | None:
        """The same on the hold-out; None without one."""

    @property
    def gap_closed(self) -> float:
        """Share of the gap to the noise floor that this step closes; NaN if no noise floor is known."""

    @property
    def why(self) -> str:
        """Reason to believe it, a sentence."""

@final
class Diagnosis:
    """The result of :func:`diagnose`. The attributes are those of ``diagnosis.json`` (docs/formats.md)."""

    @property
    def verdict(
        self,
    ) -> Literal["nothing-missing", "explained", "parameter-change", "remainder", "data-fault"]:
        """Verdict."""

    @property
    def words(self) -> list[str]:
        """The verdict in words, sentences."""

    @property
    def steps(self) -> list[Step]:
        """The effects found, in their order."""

    @property
    def gap_closed(self) -> float | None:
        """Closed share of the residual's excess over the noise floor, on the hold-out (else training)."""

    @property
    def noise_floor_rms(self) -> list[float]:
        """Noise floor of each joint; NaN if unknown."""

    @property
    def remainder(self) -> dict[str, Any] | None:
        """The unexplained residual."""

    @property
    def left(self) -> list[dict[str, Any]]:
        """Torque residual of the written model, joint by joint."""

    @property
    def absorbed(self) -> list[dict[str, Any]]:
        """Nominal parameters that changed."""

    @property
    def not_testable(self) -> list[dict[str, Any]]:
        """Effects that these data cannot show."""

    @property
    def next_experiment(self) -> dict[str, Any] | None:
        """Experiment that would separate the names of a set, or make an effect testable."""

    @property
    def data_faults(self) -> list[dict[str, Any]]:
        """Faults of the recordings."""

    @property
    def robot(self) -> Robot:
        """The description with the effects found and the parameters fitted again."""

    def to_dict(self) -> dict[str, Any]:
        """Return the contents of ``diagnosis.json``."""

    def save(self, folder: _Path, *, force: bool = False) -> None:
        """Write model.toml, diagnosis.json, report.html, the figures and, if there is one, next_experiment.toml.

        A folder with earlier results is refused unless ``force``.
        """

def diagnose(
    robot: Robot,
    data: _Recordings,
    holdout: _Recordings | None = None,
    *,
    drive_off: _OneRecording | None = None,
    pulls_off: _Recordings | None = None,
    clamped: _Recordings | None = None,
    without: Sequence[str] | None = None,
    even_if_wrong: bool = False,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress | None = None,
) -> Diagnosis:
    """Find the physical effects that a model lacks, as ``rig diagnose``.

    ``data``, ``holdout``: a :class:`Recording`, a path, a dict of columns, or a list of these. Record every motion twice:
    the difference between the two runs is the noise floor. Give another motion as ``holdout``.
    ``drive_off``: made with the drive off. ``pulls_off``: training recordings made without external loads.
    ``clamped``: made with the joints clamped. ``without``: effects that the robot cannot have.
    ``progress``: called with the share of the work, 0 to 1.

    Ctrl-C ends the call at once. Raises ``Error`` or ``OSError``.
    """

@final
class Trajectory:
    """A motion from rest to rest, made by :func:`excite`."""

    @property
    def duration(self) -> float:
        """Duration, s."""

    @property
    def condition_number(self) -> float:
        """Condition number of the regressor with columns scaled to their sizes; below 100 is good."""

    @property
    def base_parameters(self) -> list[str]:
        """The parameters that the motion makes identifiable."""

    @property
    def notes(self) -> list[str]:
        """Sentences; also issued as :class:`Remark`."""

    def sample(self, rate: float = 1000.0) -> dict[str, _Floats]:
        """Return ``t`` (n,), ``q``, ``qd`` and ``qdd`` (n, joints) at ``rate`` Hz."""

    def save(self, path: _Path, *, rate: float = 1000.0, force: bool = False) -> None:
        """Write the motion: .toml holds its parameters (for the rig), .csv its samples at ``rate`` Hz."""

def excite(
    robot: Robot,
    *,
    criterion: Literal["cond", "min-singular", "d-optimal"] = "cond",
    harmonics: int = 5,
    period: float | None = None,
    periods: int = 5,
    ramp: float | None = None,
    start: Sequence[float] | None = None,
    torque_noise: Sequence[float] | None = None,
    margin: float = 0.1,
    speed_share: float = 0.9,
    starts: int = 24,
    seed: int = 1,
    even_if_wrong: bool = False,
    progress: _Progress | None = None,
) -> Trajectory:
    """Design a Fourier motion within the robot's limits that makes its parameters identifiable, as ``rig excite``.

    Not checked: collisions of any kind, cables. The limits hold for the reference only. Watch a first run on a robot at
    low speed (``speed_share=0.2``) and keep the emergency stop at hand.

    ``period``: of the slowest harmonic, s. ``periods``: whole periods at full amplitude. ``ramp``: s.
    ``margin``: free share of each position range. ``speed_share``: used share of the velocity limits.
    ``starts``: random starts of the optimiser. ``progress``: called with the share of the work, 0 to 1.
    """

def simulate(
    robot: Robot,
    trajectory: Trajectory | _Path,
    *,
    rate: float = 1000.0,
    noise_position: float = 0.0,
    noise_velocity: float = 0.0,
    noise_torque: float = 0.0,
    seed: int = 1,
    name: str = "simulation",
    progress: _Progress | None = None,
) -> Recording:
    """Simulate the robot following a trajectory, with its effects, drives and controller, as ``rig simulate``.

    ``trajectory``: a :class:`Trajectory`, or the path of a .toml or .csv file. ``rate``: Hz.
    ``noise_position``, ``noise_velocity``, ``noise_torque``: standard deviations, SI. Returns a :class:`Recording`.
    """
