"""Recordings from files and arrays, their sentences, and the errors of files."""

import numpy as np
import pytest

import rig_dynamics as rig
from arms import ONE_LINK, TWO_LINK, two_link_recording


def written(path, columns):
    """Write columns as CSV in the shortest form that reads back."""
    t, q, tau = columns["t"], columns["q"], columns["tau"]
    lines = ["t,q1,q2,tau1,tau2"]
    lines += [",".join(repr(float(x)) for x in (t[k], *q[k], *tau[k])) for k in range(len(t))]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_arrays_read_back_bit_for_bit():
    columns = two_link_recording(1, seconds=3.0)
    recording = rig.Recording(columns, name="first run")
    assert recording.name == "first run"
    assert recording.columns == ["t", "q1", "q2", "tau1", "tau2"]
    read = recording.read(rig.Robot.from_toml(TWO_LINK))
    assert sorted(read) == ["q", "t", "tau"]
    for name, array in read.items():
        np.testing.assert_array_equal(array, columns[name])


def test_columns_by_name_and_by_joint_are_the_same(tmp_path):
    columns = two_link_recording(1, seconds=3.0)
    robot = rig.Robot.from_toml(TWO_LINK)
    named = {"t": columns["t"]}
    named.update({f"q{k + 1}": columns["q"][:, k] for k in range(2)})
    named.update({f"tau{k + 1}": columns["tau"][:, k] for k in range(2)})
    path = written(tmp_path / "run.csv", columns)
    file = rig.Recording.load(path)
    assert file.columns == ["t", "q1", "q2", "tau1", "tau2"] and file.name == str(path)
    for other in (rig.Recording(named), file):
        np.testing.assert_array_equal(other.read(robot)["tau"], columns["tau"])


def test_motor_currents_become_torques():
    robot = rig.Robot.template("one-link")
    t = np.arange(0, 1, 0.01)
    columns = {"t": t, "q1": np.sin(t), "i1": np.full_like(t, 0.5), "ref1": np.sin(t)}
    read = rig.Recording(columns).read(robot)
    text = robot.to_toml()
    value = {
        key: float(next(line for line in text.splitlines() if line.startswith(key)).split("=")[1].split("#")[0])
        for key in ("gear_ratio", "torque_constant")
    }
    np.testing.assert_allclose(read["tau"], 0.5 * value["gear_ratio"] * value["torque_constant"])
    np.testing.assert_array_equal(read["ref"][:, 0], np.sin(t))


@pytest.mark.parametrize(
    "change, sentence",
    [
        ({"t": None}, "The recording has no column t; give the time of each sample in s."),
        ({"tau": np.zeros((7, 2))}, "Column tau1 has 7 samples, but t has 1500"),
        ({"q": np.full((1500, 2), np.nan)}, "Column q1 of run is NaN at the sample with index 0, but a recording holds finite numbers only."),
        ({"q": np.zeros((1500, 2, 2))}, "Column q has 3 dimensions"),
        ({"q": ["a"]}, "q has the type <U1"),
    ],
)
def test_wrong_columns_are_named(change, sentence):
    columns = {**two_link_recording(1, seconds=3.0), **change}
    columns = {name: array for name, array in columns.items() if array is not None}
    with pytest.raises(rig.Error) as refused:
        rig.Recording(columns, name="run")
    assert sentence in str(refused.value)


def test_a_time_that_jumps_back_is_named_by_recording_and_line():
    columns = two_link_recording(1, seconds=3.0)
    columns["t"][40] = 0.0
    recording = rig.Recording(columns, name="run 7")
    with pytest.raises(rig.Error, match="^run 7:42: "):
        recording.read(rig.Robot.from_toml(TWO_LINK))
    with pytest.raises(rig.Error, match="run 7:42: "):
        rig.identify(rig.Robot.from_toml(TWO_LINK), recording)


def test_missing_joints_are_named():
    columns = two_link_recording(1, seconds=3.0)
    columns["q"] = columns["q"][:, :1]
    with pytest.raises(rig.Error, match="q2"):
        rig.identify(rig.Robot.from_toml(TWO_LINK), columns)


def test_files_raise_oserror(tmp_path):
    robot = rig.Robot.from_toml(ONE_LINK)
    for call in (rig.Robot.load, rig.Recording.load, lambda path: rig.identify(robot, path)):
        with pytest.raises(FileNotFoundError, match="nowhere.csv"):
            call(tmp_path / "nowhere.csv")
    robot.save(tmp_path / "robot.toml")
    with pytest.raises(FileExistsError, match="robot.toml exists already"):
        robot.save(tmp_path / "robot.toml")
    robot.save(tmp_path / "robot.toml", force=True)
    again = rig.Robot.load(tmp_path / "robot.toml")
    np.testing.assert_array_equal(again.parameters, robot.parameters)
    with pytest.raises(OSError, match="robot.toml"):
        robot.save(tmp_path / "robot.toml" / "below.toml")
    with pytest.raises(rig.Error, match="is written as .toml or .urdf"):
        robot.save(tmp_path / "robot.yaml")


def test_faults_of_descriptions_have_a_line():
    with pytest.raises(rig.Error, match=r"^text:6:8: .*`revolut`"):
        rig.Robot.from_toml(ONE_LINK.replace('"revolute"', '"revolut"').replace("\n\n[[joint]]", "\n[[joint]]\n"))
    with pytest.raises(rig.Error, match="is no template"):
        rig.Robot.template("two-link")


def test_remarks_are_warnings_that_can_be_filtered():
    with pytest.warns(rig.Remark, match="gravity"):
        robot = rig.Robot.from_toml(ONE_LINK.replace("-9.81", "-981.0"))
    assert len(robot.remarks) == 1
