"""Designed motions and simulated recordings."""

import numpy as np
import pytest

import rig_dynamics as rig


@pytest.fixture(scope="module")
def trajectory():
    return rig.excite(rig.Robot.template("one-link"), starts=4)


def test_a_designed_motion_keeps_the_limits_and_its_own_derivatives(trajectory):
    sampled = trajectory.sample(2000.0)
    t, q, qd, qdd = (sampled[name] for name in ("t", "q", "qd", "qdd"))
    assert t[-1] == pytest.approx(trajectory.duration, abs=1e-3)
    assert trajectory.condition_number < 100
    # The template's limits: 3.1 rad and 6 rad/s, or less.
    assert np.abs(q).max() < 3.1 and np.abs(qd).max() < 6.5
    inside = slice(1, -1)
    np.testing.assert_allclose(np.gradient(q, t, axis=0)[inside], qd[inside], atol=2e-3)
    np.testing.assert_allclose(np.gradient(qd, t, axis=0)[inside], qdd[inside], atol=5e-2)
    np.testing.assert_allclose(qd[[0, -1]], 0.0, atol=1e-9)


def test_a_simulated_recording_obeys_the_equations_of_the_robot(trajectory):
    robot = rig.Robot.template("one-link")
    recording = rig.simulate(robot, trajectory)
    read = recording.read(robot)
    t, q, qd, tau = (read[name] for name in ("t", "q", "qd", "tau"))
    moving = np.abs(qd[:, 0]) > 0.5
    qdd = np.gradient(qd, t, axis=0)
    error = (robot.inverse_dynamics(q, qd, qdd) - tau)[moving]
    assert np.sqrt(np.mean(error**2)) < 0.02 * np.sqrt(np.mean(tau[moving] ** 2))


def test_the_same_seed_gives_the_same_recording(trajectory, tmp_path):
    robot = rig.Robot.template("one-link")
    trajectory.save(tmp_path / "motion.toml")
    options = dict(noise_position=1e-4, noise_torque=0.05, rate=200.0)
    first = rig.simulate(robot, trajectory, **options).read(robot)
    again = rig.simulate(robot, tmp_path / "motion.toml", **options).read(robot)
    other = rig.simulate(robot, trajectory, seed=2, **options).read(robot)
    np.testing.assert_array_equal(first["tau"], again["tau"])
    assert np.any(first["tau"] != other["tau"])


def test_wrong_arguments_are_named(trajectory, tmp_path):
    robot = rig.Robot.template("one-link")
    with pytest.raises(rig.Error, match='criterion is "best"'):
        rig.excite(robot, criterion="best")
    with pytest.raises(rig.Error, match="3 is no trajectory"):
        rig.simulate(robot, 3)
    with pytest.raises(rig.Error, match="noise"):
        rig.simulate(robot, trajectory, noise_torque=-1.0)
    with pytest.raises(FileNotFoundError):
        rig.simulate(robot, tmp_path / "nowhere.csv")
    with pytest.raises(rig.Error, match="limits"):
        rig.excite(rig.Robot.from_toml(robot.to_toml().split("[joint.limits]")[0]))


def test_a_design_can_be_stopped():
    def stop(share):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        rig.excite(rig.Robot.template("edda"), progress=stop)
