"""A description and the URDF written from it, side by side in a dynamics library that is not ours.

    python check.py ROBOT.toml ROBOT.urdf

ROBOT.urdf is what `rig urdf --robot ROBOT.toml --out ROBOT.urdf` (or `rig identify`) writes. Pinocchio reads it with urdfdom,
the standard parser; beside it the same library's model is built joint by joint from the modified Denavit-Hartenberg
parameters, first moments and inertias of ROBOT.toml. Printed is the largest difference of the torques of both over
random positions, velocities and accelerations, over the largest torque; more than --most of it is a failure. Needs numpy
and pin (pip). `cargo test -p rig-tests --test other_engine` runs it.
"""

import argparse
import math
import sys
import tomllib

import numpy as np
import pinocchio as pin


def axis_turn(axis: str, angle: float) -> np.ndarray:
    return pin.utils.rotate(axis, angle)


def from_description(path: str) -> pin.Model:
    with open(path, "rb") as file:
        robot = tomllib.load(file)
    model = pin.Model()
    model.gravity.linear = np.array(robot["gravity"])
    parent = 0
    for joint in robot["joint"]:
        alpha, a, theta, d = (joint[key] for key in ("alpha", "a", "theta", "d"))
        place = pin.SE3(axis_turn("x", alpha), np.zeros(3)) * pin.SE3(np.eye(3), np.array([a, 0.0, 0.0]))
        place = place * pin.SE3(axis_turn("z", theta), np.zeros(3)) * pin.SE3(np.eye(3), np.array([0.0, 0.0, d]))
        kind = pin.JointModelRZ() if joint["kind"] == "revolute" else pin.JointModelPZ()
        parent = model.addJoint(parent, kind, place, joint["name"])
        body = joint["inertial"]
        mass = body["mass"]
        centre = np.array(body["first_moment"]) / mass
        xx, xy, xz, yy, yz, zz = body["inertia"]
        origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        steiner = mass * (np.dot(centre, centre) * np.eye(3) - np.outer(centre, centre))
        model.appendBodyToJoint(parent, pin.Inertia(mass, centre, origin - steiner), pin.SE3.Identity())
    return model


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("description")
    arguments.add_argument("urdf")
    arguments.add_argument("--most", type=float, default=1e-9)
    chosen = arguments.parse_args()
    ours = from_description(chosen.description)
    theirs = pin.buildModelFromUrdf(chosen.urdf)
    if list(ours.names) != list(theirs.names):
        sys.exit(f"{chosen.urdf}: joints {list(theirs.names)}, in {chosen.description} {list(ours.names)}")
    size = np.linalg.norm(ours.gravity.linear)
    # URDF states no gravity: Pinocchio takes 9.81 m/s^2 along -z of the root.
    theirs.gravity.linear = np.array([0.0, 0.0, -size])
    random = np.random.default_rng(1)
    worst = largest = 0.0
    for _ in range(1000):
        angle, speed, acceleration = (random.uniform(-r, r, ours.nv) for r in (math.pi, 3.0, 10.0))
        # A joint without end stops is a point on the circle there.
        position = pin.neutral(theirs)
        position = pin.integrate(theirs, position, angle)
        one = pin.rnea(ours, ours.createData(), angle, speed, acceleration)
        other = pin.rnea(theirs, theirs.createData(), position, speed, acceleration)
        worst = max(worst, np.abs(one - other).max())
        largest = max(largest, np.abs(one).max())
    print(f"{theirs.name}: {theirs.nv} joints, torques differ by {worst / largest:.1e} of {largest:.1f}")
    if not worst <= chosen.most * largest:
        sys.exit(f"{chosen.urdf} and {chosen.description} are not the same robot")


if __name__ == "__main__":
    main()
