"""The examples of docs/python.md run as they stand."""

import re
from pathlib import Path

import numpy as np
import pytest

import rig_dynamics as rig
from arms import ONE_LINK, pendulum_recording, random_urdf
from test_load import recorded

PAGE = (Path(__file__).parents[3] / "docs" / "python.md").read_text()
EXAMPLES = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.M | re.S)
DRIVE = "\n[joint.drive]\ngear_ratio = 10.0\ntorque_constant = 0.1\n"


def file(name, columns):
    """Write the columns t, q and tau of a recording."""
    joints = range(1, columns["q"].shape[1] + 1)
    header = ",".join(["t", *(f"q{k}" for k in joints), *(f"tau{k}" for k in joints)])
    rows = np.column_stack([columns[own] for own in ("t", "q", "tau")])
    np.savetxt(name, rows, "%.17g", ",", header=header, comments="")


def pendulum():
    """Return what examples with one joint have, and write their files."""
    Path("rig.toml").write_text(ONE_LINK + DRIVE)
    for name, seeds in [("train", (1, 11)), ("again", (1, 12)), ("other", (2, 13))]:
        file(f"{name}.csv", pendulum_recording(*seeds))
    columns = pendulum_recording(1, 11)
    q, tau = columns["q"], columns["tau"]
    return {**columns, "robot": rig.Robot.load("rig.toml"), "q1": q[:, 0], "i1": tau[:, 0], "qd": 0 * q, "qdd": 0 * q}


def loaded():
    """Return what the example of a load has, and write its file."""
    file("without.csv", recorded(2, loaded=False))
    return {**recorded(1), "robot": rig.Robot.from_urdf(random_urdf(6, 3))}


MADE = [pendulum, pendulum, pendulum, loaded]


def test_every_example_is_run():
    assert len(EXAMPLES) == len(MADE)


@pytest.mark.parametrize("example, made", zip(EXAMPLES, MADE), ids=[text.split("\n")[0] for text in EXAMPLES])
def test_the_examples_run(example, made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(example, {"rig": rig, **made()})
