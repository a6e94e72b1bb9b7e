"""The dynamics against Pinocchio, finite differences and the balance of energy; shapes, strides, memory and threads."""

import json
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import rig_dynamics as rig
from arms import ONE_LINK, TWO_LINK, TwoLink, random_urdf, states

ARMS = [(6, 1, ()), (7, 2, ()), (5, 3, (1, 3))]


def symmetric(upper):
    """Return the symmetric matrix of an upper triangle, whatever lies below."""
    return np.triu(upper) + np.triu(upper, 1).T


@pytest.mark.parametrize("joints, seed, prismatic", ARMS)
def test_pinocchio_gives_the_same_torques_accelerations_and_matrices(joints, seed, prismatic):
    text = random_urdf(joints, seed, prismatic)
    robot = rig.Robot.from_urdf(text)
    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    q, qd, qdd = states(joints, 300, seed)
    tau = robot.inverse_dynamics(q, qd, qdd)
    mass, gravity = robot.mass_matrix(q), robot.gravity(q)
    acceleration = robot.forward_dynamics(q, qd, tau)
    for k in range(len(q)):
        expected = pinocchio.rnea(model, data, q[k], qd[k], qdd[k])
        np.testing.assert_allclose(tau[k], expected, rtol=1e-9, atol=1e-9)
        full = symmetric(pinocchio.crba(model, data, q[k]))
        np.testing.assert_allclose(mass[k], full, rtol=1e-9, atol=1e-9)
        held = pinocchio.computeGeneralizedGravity(model, data, q[k])
        np.testing.assert_allclose(gravity[k], held, rtol=1e-9, atol=1e-9)
        aba = pinocchio.aba(model, data, q[k], qd[k], expected)
        np.testing.assert_allclose(acceleration[k], aba, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("joints, seed, prismatic", ARMS)
def test_pinocchio_gives_the_same_derivatives(joints, seed, prismatic):
    text = random_urdf(joints, seed, prismatic)
    robot = rig.Robot.from_urdf(text)
    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    q, qd, qdd = states(joints, 100, seed)
    tau = robot.inverse_dynamics(q, qd, qdd)
    torque = robot.inverse_dynamics_derivatives(q, qd, qdd)
    acceleration = robot.forward_dynamics_derivatives(q, qd, tau)
    assert all(part.shape == (100, joints, joints) for part in (*torque, *acceleration))
    one = robot.inverse_dynamics_derivatives(q[7], qd[7], qdd[7])
    for k in range(len(q)):
        by_q, by_qd, mass = pinocchio.computeRNEADerivatives(model, data, q[k], qd[k], qdd[k])
        for own, other in zip(torque, (by_q, by_qd, symmetric(mass))):
            np.testing.assert_allclose(own[k], other, rtol=1e-8, atol=1e-8)
        by_q, by_qd, inverse = pinocchio.computeABADerivatives(model, data, q[k], qd[k], tau[k])
        for own, other in zip(acceleration, (by_q, by_qd, symmetric(inverse))):
            np.testing.assert_allclose(own[k], other, rtol=1e-7, atol=1e-7 * np.abs(other).max())
    for whole, single in zip(torque, one):
        np.testing.assert_array_equal(whole[7], single)


def test_an_arm_whose_axes_follow_joints_is_that_of_other_engines():
    """tests/mimic has torques of MuJoCo and Pinocchio, which moved all six axes; two of them follow joints."""
    folder = Path(__file__).resolve().parents[3] / "tests" / "mimic"
    robot = rig.Robot.load(folder / "robot.urdf")
    states = {name: np.array(rows) for name, rows in json.loads((folder / "states.json").read_text()).items()}
    q, qd, qdd = (states[name] for name in ("q", "qd", "qdd"))
    tau = robot.inverse_dynamics(q, qd, qdd)
    for engine in ("pinocchio", "mujoco"):
        np.testing.assert_allclose(tau, states[engine], rtol=1e-8, atol=1e-8)
    mass = states["inertia"].reshape(len(q), 4, 4)
    np.testing.assert_allclose(robot.mass_matrix(q), mass, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(robot.forward_dynamics(q, qd, tau), qdd, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(robot.regressor(q, qd, qdd) @ robot.parameters.ravel(), tau, rtol=1e-9, atol=1e-9)
    assert rig.base_parameters(robot).rank == 41


def test_closed_form_equations_give_the_same_torques():
    robot = rig.Robot.from_toml(TWO_LINK)
    q, qd, qdd = states(2, 500, 4)
    regressor = robot.regressor(q, qd, qdd)
    tau = regressor @ TwoLink().standard_parameters()
    np.testing.assert_allclose(tau, TwoLink().torque(q, qd, qdd), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["one-link", "edda"])
def test_regressor_times_parameters_is_the_torque(name):
    robot = rig.Robot.template(name)
    joints = len(robot.joints)
    q, qd, qdd = states(joints, 200, 5)
    tau = robot.regressor(q, qd, qdd) @ robot.parameters.ravel()
    np.testing.assert_allclose(tau, robot.inverse_dynamics(q, qd, qdd), rtol=1e-12, atol=1e-12)
    assert np.any(robot.parameters[:, 11:] != 0), "friction takes part"
    assert len(robot.parameter_names) == len(robot.parameter_units) == 14 * joints


def test_power_of_the_joints_is_the_change_of_energy():
    robot = rig.Robot.from_urdf(random_urdf(6, 6))
    q, qd, qdd = states(6, 100, 6)
    step = 1e-5

    def kinetic(s):
        position, velocity = q + s * qd + s**2 / 2 * qdd, qd + s * qdd
        return np.einsum("ni,nij,nj->n", velocity, robot.mass_matrix(position), velocity) / 2

    change = (kinetic(step) - kinetic(-step)) / (2 * step)
    power = np.einsum("ni,ni->n", qd, robot.inverse_dynamics(q, qd, qdd) - robot.gravity(q))
    np.testing.assert_allclose(power, change, rtol=1e-5, atol=1e-4)


def test_mass_matrix_is_the_derivative_of_torque_by_acceleration():
    robot = rig.Robot.template("edda")
    q, qd, qdd = states(2, 50, 7)
    mass = robot.mass_matrix(q)
    for joint in range(2):
        more = qdd.copy()
        more[:, joint] += 1.0
        column = robot.inverse_dynamics(q, qd, more) - robot.inverse_dynamics(q, qd, qdd)
        np.testing.assert_allclose(mass[:, :, joint], column, rtol=1e-9, atol=1e-9)


def test_one_sample_and_no_sample_keep_their_shape():
    robot = rig.Robot.from_urdf(random_urdf(5, 8))
    q, qd, qdd = states(5, 3, 8)
    many, one = (robot.inverse_dynamics(*s) for s in ((q, qd, qdd), (q[1], qd[1], qdd[1])))
    assert many.shape == (3, 5) and one.shape == (5,)
    np.testing.assert_array_equal(one, many[1])
    assert robot.mass_matrix(q[0]).shape == (5, 5)
    assert robot.mass_matrix(q).shape == (3, 5, 5)
    assert robot.regressor(q[0], qd[0], qdd[0]).shape == (5, 70)
    assert robot.gravity(np.zeros((0, 5))).shape == (0, 5)


def test_any_strides_and_types_give_the_same_numbers():
    robot = rig.Robot.from_urdf(random_urdf(6, 9))
    q, qd, qdd = states(6, 1000, 9)
    expected = robot.inverse_dynamics(q, qd, qdd)
    wide = np.zeros((2000, 12))
    wide[::2, ::2] = q
    backwards = np.ascontiguousarray(qd[::-1, ::-1])[::-1, ::-1]
    unaligned = np.frombuffer(b"x" + qdd.tobytes(), dtype=np.uint8)[1:].view(np.float64)
    got = robot.inverse_dynamics(wide[::2, ::2], backwards, unaligned.reshape(qdd.shape))
    np.testing.assert_array_equal(got, expected)
    got = robot.inverse_dynamics(np.asfortranarray(q), qd.astype(">f8"), qdd.tolist())
    np.testing.assert_array_equal(got, expected)
    single = q.astype(np.float32)
    got = robot.inverse_dynamics(single, qd, qdd)
    assert got.dtype == np.float64
    np.testing.assert_array_equal(got, robot.inverse_dynamics(single.astype(np.float64), qd, qdd))
    np.testing.assert_array_equal(robot.gravity([[0] * 6]), robot.gravity(np.zeros((1, 6))))


@pytest.mark.parametrize("joints, seed, prismatic", ARMS)
def test_float32_gives_the_same_as_float64_within_its_precision(joints, seed, prismatic):
    robot = rig.Robot.from_urdf(random_urdf(joints, seed, prismatic))
    single = [own.astype(np.float32) for own in states(joints, 1000, seed)]
    double = [own.astype(np.float64) for own in single]
    calls = [
        (robot.inverse_dynamics, 3),
        (robot.forward_dynamics, 3),
        (robot.inverse_dynamics_derivatives, 3),
        (robot.forward_dynamics_derivatives, 3),
        (robot.regressor, 3),
        (robot.mass_matrix, 1),
        (robot.gravity, 1),
    ]
    for call, signals in calls:
        got, expected = call(*single[:signals]), call(*double[:signals])
        if not isinstance(got, tuple):
            got, expected = (got,), (expected,)
        for own, other in zip(got, expected):
            assert own.dtype == np.float32 and other.dtype == np.float64
            assert own.shape == other.shape
            # Forward dynamics loses what the condition of the inertia matrix says: about 100 on these arms.
            scale = np.abs(other).max()
            assert np.abs(own - other).max() < 3e-4 * scale, call.__name__
            assert 0 < np.abs(own - other).max(), call.__name__


def test_float32_arrays_of_any_strides_give_the_same_numbers():
    robot = rig.Robot.from_urdf(random_urdf(6, 9))
    q, qd, qdd = (own.astype(np.float32) for own in states(6, 1000, 9))
    expected = robot.inverse_dynamics(q, qd, qdd)
    wide = np.zeros((2000, 12), np.float32)
    wide[::2, ::2] = q
    unaligned = np.frombuffer(b"x" + qdd.tobytes(), dtype=np.uint8)[1:].view(np.float32)
    got = robot.inverse_dynamics(wide[::2, ::2], np.asfortranarray(qd), unaligned.reshape(qdd.shape))
    np.testing.assert_array_equal(got, expected)
    np.testing.assert_array_equal(robot.inverse_dynamics(q[5], qd[5], qdd[5]), expected[5])


def test_read_only_arrays_are_read_and_inputs_stay_as_they_are():
    robot = rig.Robot.from_urdf(random_urdf(3, 10))
    q, qd, qdd = states(3, 10, 10)
    before = q.copy()
    for array in (q, qd, qdd):
        array.flags.writeable = False
    tau = robot.inverse_dynamics(q, qd, qdd)
    np.testing.assert_array_equal(q, before)
    tau[0] = 0.0
    assert tau.flags.writeable and tau.flags.c_contiguous


def test_threads_change_no_bit():
    robot = rig.Robot.from_urdf(random_urdf(6, 11))
    q, qd, qdd = states(6, 30_011, 11)
    for call in (robot.inverse_dynamics, robot.forward_dynamics, robot.regressor):
        alone = call(q, qd, qdd, threads=1)
        for threads in (0, 2, 7):
            np.testing.assert_array_equal(call(q, qd, qdd, threads=threads), alone)


@pytest.mark.parametrize(
    "q, sentence",
    [
        (np.zeros((4, 2)), "q has shape (4, 2); a robot with 3 joints needs (n, 3) for n samples, or (3,) for one."),
        (np.zeros(4), "q has shape (4,);"),
        (np.zeros((1, 4, 3)), "q has shape (1, 4, 3);"),
        (np.zeros((4, 3), complex), "q has the type complex128; give real numbers"),
        (np.zeros((4, 3), bool), "q has the type bool;"),
        ([["1", "2", "3"]], "q has the type <U1;"),
        ([[1.0], [1.0, 2.0]], "q is a list from which NumPy makes no array"),
        (None, "q has the type object;"),
    ],
)
def test_other_shapes_and_types_are_refused_with_a_sentence(q, sentence):
    robot = rig.Robot.from_urdf(random_urdf(3, 12))
    with pytest.raises(rig.Error) as refused:
        robot.gravity(q)
    assert sentence in str(refused.value)
    assert isinstance(refused.value, ValueError)


def test_signals_of_other_lengths_are_refused():
    robot = rig.Robot.from_urdf(random_urdf(3, 12))
    with pytest.raises(rig.Error, match=r"q has shape \(4, 3\), but qdd has shape \(5, 3\)"):
        robot.inverse_dynamics(np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((5, 3)))


def test_impossible_bodies_are_named_by_sample():
    robot = rig.Robot.from_toml(ONE_LINK)
    q = np.zeros((9000, 1))
    q[8123] = np.nan
    robot.forward_dynamics(np.zeros((9000, 1)), q, q)
    arm = rig.Robot.from_urdf(random_urdf(3, 13))
    q = np.zeros((9000, 3))
    q[8123, 2] = np.nan
    with pytest.raises(rig.Error, match="inertia matrix of sample 8123 is not positive definite"):
        arm.forward_dynamics(q, np.zeros_like(q), np.zeros_like(q))


MEMORY = """
import resource, sys
kind = sys.argv[1]
import numpy as np
import rig_dynamics as rig
robot = rig.Robot.from_urdf(sys.stdin.read())
n = 1_000_000
q = np.full((n, 6), 0.3, kind)
robot.inverse_dynamics(q[:5000], q[:5000], q[:5000])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
tau = robot.inverse_dynamics(q, q, q)
after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print((after - before) * 1024 / tau.nbytes)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss has this unit on Linux alone")
@pytest.mark.parametrize("kind", ["float64", "float32"])
def test_a_large_array_is_not_copied(kind):
    run = subprocess.run(
        [sys.executable, "-c", MEMORY, kind], input=random_urdf(6, 14), capture_output=True, text=True, check=True
    )
    # The output alone. A copy of one signal would add 1.
    assert float(run.stdout) < 1.3


def test_other_threads_run_during_a_computation():
    robot = rig.Robot.from_urdf(random_urdf(7, 15))
    q, qd, qdd = states(7, 100_000, 15)
    count, stop = 0, threading.Event()

    def work():
        nonlocal count
        while not stop.is_set():
            count += 1
            time.sleep(0)

    interval = sys.getswitchinterval()
    # Threads change only where one of them lets go of the interpreter's lock.
    sys.setswitchinterval(1000.0)
    other = threading.Thread(target=work)
    try:
        other.start()
        before = count
        for _ in range(5):
            robot.inverse_dynamics(q, qd, qdd)
        during = count - before
    finally:
        stop.set()
        sys.setswitchinterval(interval)
        other.join()
    assert during > 0
