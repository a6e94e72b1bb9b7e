"""Identify the dynamics of robots from recordings, and find the physical effects that a model lacks.

From a recording to a diagnosis::

    import rig_dynamics as rig
    robot = rig.Robot.load("arm.urdf")
    found = rig.diagnose(robot, ["train.csv", "train-again.csv"], "holdout.csv")
    print(found.verdict, found.steps)
    found.save("diagnosis")

All quantities are in SI units and on the joint side. Arrays of a motion have the shape (n, joints): one row a sample.
"""

from ._native import (
    BaseParameter,
    BaseParameters,
    Diagnosis,
    Error,
    Identification,
    JointFit,
    LoadIdentification,
    Recording,
    Remark,
    Robot,
    Step,
    Trajectory,
    Value,
    base_parameters,
    diagnose,
    excite,
    identify,
    identify_load,
    simulate,
)

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
