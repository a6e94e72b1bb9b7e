"""Identification of recordings that the tests' own equations made."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rig_dynamics as rig
from arms import TWO_LINK, TwoLink, two_link_recording
from test_recordings import written


@pytest.fixture(scope="module")
def robot():
    return rig.Robot.from_toml(TWO_LINK)


@pytest.fixture(scope="module")
def found(robot):
    return rig.identify(robot, two_link_recording(1), two_link_recording(2), estimator="weighted")


def test_parameters_of_closed_form_equations_are_recovered(robot, found):
    base = rig.base_parameters(robot)
    truth = dict(zip(base.expressions, base.combination @ TwoLink().standard_parameters()))
    assert len(base) == base.rank == found.rank == len(found.base_parameters)
    for own in found.base_parameters:
        assert abs(own.value - truth[own.expression]) < 3.5 * own.std, own
        assert own.interval[0] < own.value < own.interval[1]
        # The friction, inertia and gravity of both links are well determined.
        assert own.std < 0.03 * max(abs(own.value), 0.5), own


def test_residual_is_less_than_the_noise_and_the_same_on_the_holdout(found):
    assert [joint.name for joint in found.joints] == ["shoulder", "elbow"]
    for joint in found.joints:
        # White noise of 0.05 N*m, of which the low-pass leaves a part.
        assert 0 < joint.train_residual_rms < 0.05
        assert 0.8 < joint.holdout_residual_rms / joint.train_residual_rms < 1.3


def test_the_identified_robot_predicts_a_new_motion(robot, found):
    from arms import motion

    q, qd, qdd = motion(np.arange(0, 5, 0.01), 33, 2)
    error = found.robot.inverse_dynamics(q, qd, qdd) - TwoLink().torque(q, qd, qdd)
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert found.robot.parameters.shape == (2, 14)


def test_attributes_are_those_of_the_json(found, tmp_path):
    found.save(tmp_path / "result")
    names = {path.name for path in (tmp_path / "result").iterdir()}
    assert {"identified.toml", "identification.json", "report.html"} <= names
    stored = json.loads((tmp_path / "result" / "identification.json").read_text())
    assert found.to_dict() == stored
    assert stored["estimator"] == found.estimator == "weighted"
    assert stored["rank"] == found.rank and stored["model"] == found.model
    assert stored["condition_number"] == found.condition_number
    for own, in_file in zip(found.base_parameters, stored["base_parameters"]):
        for key in ("expression", "value", "std", "unit", "relative_std_percent"):
            assert getattr(own, key) == in_file[key]
    for own, in_file in zip(found.joints, stored["joints"]):
        for key in ("name", "train_residual_rms", "holdout_residual_rms", "train_relative_error"):
            assert getattr(own, key) == in_file[key]
    with pytest.raises(FileExistsError):
        found.save(tmp_path / "result")
    found.save(tmp_path / "result", force=True)
    page = (tmp_path / "result" / "report.html").read_text()
    assert "rig_dynamics.identify(" in page


def test_files_and_arrays_give_the_same_result(robot, tmp_path):
    columns = [two_link_recording(seed, seconds=8.0) for seed in (1, 2)]
    paths = [written(tmp_path / f"{k}.csv", own) for k, own in enumerate(columns)]
    from_arrays = rig.identify(robot, columns[0], columns[1])
    from_files = rig.identify(robot, str(paths[0]), [rig.Recording.load(paths[1])])
    assert from_arrays.to_dict() == from_files.to_dict()
    assert from_arrays.estimator == "consistent"


@pytest.mark.skipif("RIG_PROGRAM" not in os.environ, reason="RIG_PROGRAM does not name the program rig")
def test_the_program_gives_the_same_result(robot, tmp_path):
    robot.save(tmp_path / "robot.toml")
    paths = [written(tmp_path / f"{k}.csv", two_link_recording(k, seconds=8.0)) for k in (1, 2)]
    command = [os.environ["RIG_PROGRAM"], "identify", "--robot", tmp_path / "robot.toml", "--data", paths[0]]
    command += ["--holdout", paths[1], "--out", tmp_path / "out"]
    subprocess.run(command, check=True, capture_output=True)
    stored = json.loads((tmp_path / "out" / "identification.json").read_text())
    own = rig.Robot.load(tmp_path / "robot.toml")
    assert rig.identify(own, paths[0], paths[1], compare="auto").to_dict() == stored


def test_wrong_signs_are_refused_and_named(robot):
    columns = two_link_recording(1)
    columns["tau"] = -columns["tau"]
    with pytest.raises(rig.Error, match="Nothing was fitted; give even_if_wrong=True"):
        rig.identify(robot, rig.Recording(columns, name="mirrored"), estimator="weighted")


@pytest.mark.parametrize(
    "options, sentence",
    [
        ({"estimator": "best"}, 'estimator is "best"; give one of ols, weighted,'),
        ({"model": "energy"}, 'model is "energy"; give "differential" or "integral".'),
        ({"compare": "some"}, 'compare is "some"; give "auto", "all", None or a list'),
        ({"weights": [1.0, 2.0]}, "weights has 2 numbers, but data has 1 recordings"),
        ({"torque_lead": 3.0}, "torque_lead is 3 s; it must lie between"),
        ({"min_speed": -1.0}, "min_speed is -1; 0 keeps all rows"),
    ],
)
def test_wrong_options_are_refused(robot, options, sentence):
    with pytest.raises(rig.Error) as refused:
        rig.identify(robot, two_link_recording(1, seconds=3.0), **options)
    assert sentence in str(refused.value)


def test_a_recording_for_two_uses_is_refused(robot):
    recording = rig.Recording(two_link_recording(1, seconds=3.0), name="only run")
    with pytest.raises(rig.Error, match="^only run is given both as training data and as --holdout"):
        rig.identify(robot, recording, recording)
    with pytest.raises(rig.Error, match="^only run is given twice"):
        rig.identify(robot, [recording, recording])
    with pytest.raises(rig.Error, match="3 is no recording"):
        rig.identify(robot, 3)


def test_progress_grows_to_the_end(robot):
    shares = []
    rig.identify(robot, two_link_recording(1, seconds=8.0), estimator="weighted", progress=shares.append)
    assert shares == sorted(shares) and 0 <= shares[0] <= shares[-1] == 1


def test_an_exception_in_the_progress_function_ends_the_work(robot):
    class Enough(Exception):
        pass

    def stop(share):
        raise Enough

    with pytest.raises(Enough):
        rig.identify(robot, two_link_recording(1, seconds=8.0), progress=stop)


def test_base_parameters_have_expressions_and_units(robot):
    base = rig.base_parameters(robot)
    assert base.combination.shape == (base.rank, 28)
    assert len(base.expressions) == len(base.units) == len(base.columns) == base.rank
    # One parameter represents each: its own column has factor 1.
    for row, column in enumerate(base.columns):
        assert base.combination[row, column] == pytest.approx(1.0)
    with pytest.raises(rig.Error, match='model is "energy"'):
        rig.base_parameters(robot, "energy")


def test_parameters_of_axes_that_follow_joints_are_recovered(tmp_path):
    """Pinocchio moves all six axes of the arm; the recording has the four joints."""
    script = Path(__file__).resolve().parents[3] / "tests" / "other_engine" / "record.py"
    options = ["--arm", "mimic", "--engine", "pinocchio", "--seed", "9", "--out", str(tmp_path)]
    subprocess.run([sys.executable, str(script), *options], check=True)
    robot, truth = (rig.Robot.load(tmp_path / name) for name in ("robot.urdf", "true.urdf"))
    friction = json.loads((tmp_path / "truth.json").read_text())["friction"]
    parameters = truth.parameters.copy()
    for column, name in enumerate(("viscous", "coulomb", "offset"), start=11):
        parameters[:4, column] = friction[name]
    base = rig.base_parameters(robot)
    expected = dict(zip(base.expressions, base.combination @ parameters.ravel()))
    found = rig.identify(robot, tmp_path / "train.csv", estimator="weighted").to_dict()["base_parameters"]
    off = np.array([own["value"] - expected[own["expression"]] for own in found])
    half = np.array([(own["interval"][1] - own["interval"][0]) / 2 for own in found])
    assert len(found) == base.rank == 41
    # The 95 % intervals hold the truth of 35 to 41 of 41 (fewer in 0.4 % of draws), and none is far off.
    assert (np.abs(off) < half).sum() >= 35
    assert (np.abs(off) < 3 * half).all()
