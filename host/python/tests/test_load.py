"""A known load at the flange, of recordings that Pinocchio made."""

import json

import numpy as np
import pinocchio
import pytest

import rig_dynamics as rig
from arms import motion, random_urdf

JOINTS = 6
MASS = 1.7  # kg
CENTRE = np.array([0.03, -0.02, 0.09])  # m, in the frame of the last link
INERTIA = np.array([[0.012, 0.001, -0.002], [0.001, 0.015, 0.0015], [-0.002, 0.0015, 0.009]])  # kg*m^2, about the centre
BIAS = np.array([3.0, -5.0, 8.0, 0.3, -0.1, 0.2])  # N and N*m
NAMES = ["fx", "fy", "fz", "mx", "my", "mz"]


def recorded(seed, loaded=True, seconds=20.0, rate=200.0):
    """Return the columns of a recording with joint torques and a sensor that reads the wrench of the load on the robot."""
    arm = pinocchio.buildModelFromXML(random_urdf(JOINTS, 3))
    load = pinocchio.Inertia(MASS, CENTRE, INERTIA)
    if loaded:
        arm.appendBodyToJoint(JOINTS, load, pinocchio.SE3.Identity())
    data = arm.createData()
    random = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / rate)
    q, qd, qdd = motion(t, 5, JOINTS)
    tau, wrench = np.zeros_like(q), np.zeros((len(t), 6))
    for k in range(len(t)):
        tau[k] = pinocchio.rnea(arm, data, q[k], qd[k], qdd[k])
        # Newton and Euler of the load in the frame of the last joint; a_gf contains gravity.
        speed, acceleration = data.v[JOINTS], data.a_gf[JOINTS]
        force = load * acceleration + speed.cross(load * speed)
        wrench[k] = -np.concatenate([force.linear, force.angular]) if loaded else 0.0
    wrench += BIAS + random.normal(size=wrench.shape) * np.repeat([0.1, 0.01], 3)
    tau += 0.02 * random.normal(size=tau.shape)
    columns = {"t": t, "q": q + 1e-5 * random.normal(size=q.shape), "tau": tau}
    return {**columns, **dict(zip(NAMES, wrench.T))}


def parameters():
    """Return the ten parameters of the load, the inertia about the flange's origin."""
    about = INERTIA + MASS * (CENTRE @ CENTRE * np.eye(3) - np.outer(CENTRE, CENTRE))
    return np.concatenate([[MASS], MASS * CENTRE, about[np.triu_indices(3)]])


@pytest.fixture(scope="module")
def robot():
    return rig.Robot.from_urdf(random_urdf(JOINTS, 3))


@pytest.fixture(scope="module")
def by_sensor(robot):
    return rig.identify_load(robot, recorded(1))


def is_found(found):
    std = np.sqrt(np.diag(found.covariance))
    assert (np.abs(found.parameters - parameters()) < 4 * std).all(), (found.parameters, parameters(), std)
    assert abs(found.mass - MASS) < 0.02 * MASS
    assert np.abs(found.centre - CENTRE).max() < 0.003
    assert found.centre.shape == found.centre_std.shape == (3,)
    return True


def test_a_load_that_pinocchio_carries_is_found_by_a_sensor(by_sensor):
    assert is_found(by_sensor)
    assert len(by_sensor.shown) == 10 and not by_sensor.not_shown
    assert np.abs(by_sensor.inertia - INERTIA).max() < 0.002
    assert (by_sensor.inertia == by_sensor.inertia.T).all()
    assert (np.abs(by_sensor.inertia - INERTIA) < 4 * by_sensor.inertia_std).all()


def test_a_load_that_pinocchio_carries_is_found_by_torques_with_and_without_it(robot):
    with_load, without = recorded(1), recorded(2, loaded=False)
    for columns in (with_load, without):
        for name in NAMES:
            del columns[name]
    assert is_found(rig.identify_load(robot, with_load, without, by="torque"))


def test_the_files_are_those_of_the_program(by_sensor, tmp_path):
    by_sensor.save(tmp_path / "load")
    names = {path.name for path in (tmp_path / "load").iterdir()}
    assert names == {"load.toml", "load.urdf", "load.json", "report.html"}
    assert json.loads((tmp_path / "load" / "load.json").read_text()) == by_sensor.to_dict()
    assert by_sensor.to_dict()["mass"]["value"] == by_sensor.mass
    with pytest.raises(FileExistsError):
        by_sensor.save(tmp_path / "load")
    assert "rig_dynamics.identify_load(" in (tmp_path / "load" / "report.html").read_text()


def test_what_is_known_of_the_load_is_taken(robot, by_sensor, tmp_path):
    by_sensor.save(tmp_path / "load")
    remark = "the known mass|is not that of|scale of"
    with pytest.warns(rig.Remark, match=remark):
        rig.identify_load(robot, recorded(1), mass=2 * MASS, mass_std=0.01)
    with pytest.raises(rig.Error, match="are left for it"):
        rig.identify_load(robot, recorded(1), subtract=tmp_path / "load" / "load.toml")


@pytest.mark.parametrize(
    "options, sentence",
    [
        ({"by": "weight"}, 'by is "weight"; give one of "sensor", "torque", "both".'),
        ({"reads": "arm"}, 'reads is "arm"; give one of "load", "robot".'),
        ({"poses": True, "by": "torque"}, "is for the wrist sensor alone"),
        ({"sensor_position": [1.0]}, "give three numbers"),
        ({"mass": -1.0}, "give a mass greater than 0"),
    ],
)
def test_wrong_options_are_refused(robot, options, sentence):
    with pytest.raises(rig.Error) as refused:
        rig.identify_load(robot, recorded(1, seconds=3.0), **options)
    assert sentence in str(refused.value)
