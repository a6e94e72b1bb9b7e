"""Diagnosis of recordings in which the tests' own equations hide an effect."""

import _thread
import json
import signal
import threading

import numpy as np
import pytest

import rig_dynamics as rig
from arms import ONE_LINK, Pendulum, pendulum_recording


@pytest.fixture(scope="module")
def robot():
    return rig.Robot.from_toml(ONE_LINK)


@pytest.fixture(scope="module")
def found(robot):
    train = [pendulum_recording(1, 11), pendulum_recording(1, 12)]
    return rig.diagnose(robot, train, pendulum_recording(2, 13))


def test_a_hidden_stribeck_friction_is_found_with_its_size(found):
    assert found.verdict == "explained", found.words
    assert "stribeck" in {name for step in found.steps for name in step.set}
    step = found.steps[0]
    assert step.joint == "link" and step.p_value < 0.01
    assert step.holdout_rms[1] < step.holdout_rms[0]
    assert found.gap_closed > 0.9
    for value in step.parameters.values():
        assert value.std >= 0 and value.unit
    # White noise of 0.02 N*m, of which the low-pass leaves a part.
    assert 0 < found.noise_floor_rms[0] < 0.02
    assert found.left[0]["explained"] and found.left[0]["on_holdout"]


def test_the_model_with_the_effect_is_a_robot(robot, found):
    assert found.robot.effects and not robot.effects
    assert found.robot.parameters[0, 9] == pytest.approx(Pendulum.inertia, rel=0.05)


def test_the_dict_is_the_json_of_the_folder(found, tmp_path):
    found.save(tmp_path / "out")
    stored = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found.to_dict() == stored
    assert stored["verdict"] == found.verdict
    assert stored["remainder"] == found.remainder and stored["left"] == found.left
    assert [step["effect"] for step in stored["steps"]] == [step.effect for step in found.steps]
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"model.toml", "diagnosis.json", "report.html"} <= names
    assert rig.Robot.load(tmp_path / "out" / "model.toml").effects == found.robot.effects
    with pytest.raises(FileExistsError, match="of an earlier run"):
        found.save(tmp_path / "out")


def test_nothing_is_found_where_nothing_is_missing(robot):
    train = [pendulum_recording(1, 11, stribeck=False), pendulum_recording(1, 12, stribeck=False)]
    found = rig.diagnose(robot, train, pendulum_recording(2, 13, stribeck=False))
    assert found.verdict in ("nothing-missing", "parameter-change"), found.words
    assert found.steps == []


def test_a_wrong_sign_is_a_fault_of_the_data(robot):
    columns = pendulum_recording(1, 11)
    columns["tau"] = -columns["tau"]
    found = rig.diagnose(robot, rig.Recording(columns, name="mirrored"))
    assert found.verdict == "data-fault" and found.steps == []
    assert found.data_faults[0]["recording"] == "mirrored"


def test_unknown_effects_are_named(robot):
    with pytest.raises(rig.Error, match='without has "sticktion", but no effect has that name; the names are'):
        rig.diagnose(robot, pendulum_recording(1, 11), without=["sticktion"])


def test_ctrl_c_ends_a_diagnosis(robot):
    train = [pendulum_recording(1, 11), pendulum_recording(1, 12)]
    # A shell that starts the tests in the background has them ignore Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    # Arrives while the main thread waits in native code.
    timer = threading.Timer(0.1, _thread.interrupt_main)
    timer.start()
    shares = []
    with pytest.raises(KeyboardInterrupt):
        rig.diagnose(robot, train, pendulum_recording(2, 13), progress=shares.append)
    signal.signal(signal.SIGINT, before)
    assert 1.0 not in shares, "the diagnosis had not ended"


def test_an_exception_in_the_progress_function_ends_the_work(robot):
    def progress(share):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        rig.diagnose(robot, pendulum_recording(1, 11), progress=progress)
