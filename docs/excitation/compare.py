"""Condition numbers of motions of one arm by one measure, with a dynamics library that is not ours.

    python compare.py ROBOT.toml [--waypoints train_waypoints.json] MOTION.csv ...

MOTION.csv is what `rig excite --out MOTION.csv` writes. train_waypoints.json is FIGAROH's published optimal trajectory of
the UR10e (figaroh-examples, examples/ur10/data/truth): rest-to-rest quintics between its waypoints. For each motion, whole
from rest to rest, are printed: its length, the condition number of the stacked regressor in SI units over the 36 base
columns of FIGAROH's protocol (inertial parameters of the links alone, samples at 100 Hz), and the highest share of any
limit in ROBOT.toml. Needs numpy and pin (pip).
"""

import argparse
import json
import tomllib

import numpy as np
import pinocchio as pin

# Representatives of the base parameters in figaroh-examples/examples/ur10/data/truth/protocol.yaml, joint from 1.
NAMES = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz"]
BASE = {
    1: "Izz",
    2: "mx my Ixy Iyy Ixz Iyz Izz",
    3: "mx my Ixy Iyy Ixz Iyz Izz",
    4: "mx my Ixx Ixy Ixz Iyz",
    5: "mx Ixx Ixy Iyy Ixz Iyz",
    6: "mx my mz Ixx Ixy Iyy Ixz Iyz Izz",
}
COLUMNS = [10 * (j - 1) + NAMES.index(name) for j, names in BASE.items() for name in names.split()]


def model_of(description):
    """The chain by its modified Denavit-Hartenberg parameters."""
    model = pin.Model()
    parent = 0
    for joint in description["joint"]:
        turn = pin.rpy.rpyToMatrix(joint["alpha"], 0.0, 0.0)
        shift = np.array([joint["a"], 0.0, 0.0]) + turn @ np.array([0.0, 0.0, joint["d"]])
        assert joint["theta"] == 0.0 and joint["kind"] == "revolute"
        parent = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(turn, shift), joint["name"])
        body = joint["inertial"]
        xx, xy, xz, yy, yz, zz = body["inertia"]
        pi = [body["mass"], *body["first_moment"], xx, xy, yy, xz, yz, zz]
        model.appendBodyToJoint(parent, pin.Inertia.FromDynamicParameters(np.array(pi)), pin.SE3.Identity())
    return model


def quintics(path, rate):
    """Rest-to-rest quintics between waypoints."""
    file = json.load(open(path))
    points, span = np.array(file["waypoints"]), file["interval_s"]
    t = np.arange(0.0, span - 0.5 / rate, 1.0 / rate)
    s = (t / span)[:, None]
    q, v, a = [], [], []
    for start, end in zip(points, points[1:]):
        way = end - start
        q.append(start + (10 * s**3 - 15 * s**4 + 6 * s**5) * way)
        v.append((30 * s**2 - 60 * s**3 + 30 * s**4) / span * way)
        a.append((60 * s - 180 * s**2 + 120 * s**3) / span**2 * way)
    return span * (len(points) - 1), np.vstack(q), np.vstack(v), np.vstack(a)


def recorded(path, joints, rate):
    table = np.genfromtxt(path, delimiter=",", names=True)
    step = max(1, round(1.0 / rate / (table["t"][1] - table["t"][0])))
    pick = lambda name: np.column_stack([table[f"{name}{k}"] for k in range(1, joints + 1)])[::step]
    return table["t"][-1], pick("q"), pick("qd"), pick("qdd")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("robot")
    parser.add_argument("motions", nargs="*")
    parser.add_argument("--waypoints")
    parser.add_argument("--peaks", action="store_true", help="print the largest values of each joint")
    given = parser.parse_args()
    description = tomllib.load(open(given.robot, "rb"))
    model = model_of(description)
    data = model.createData()
    limits = [joint["limits"] for joint in description["joint"]]
    low, high = np.array([limit["position"] for limit in limits]).T
    most = {key: np.array([limit[key] for limit in limits]) for key in ("velocity", "acceleration", "torque")}
    motions = [(given.waypoints, quintics(given.waypoints, 100.0))] if given.waypoints else []
    motions += [(path, recorded(path, model.nv, 100.0)) for path in given.motions]
    for name, (length, q, v, a) in motions:
        rows = np.vstack([pin.computeJointTorqueRegressor(model, data, *x)[:, COLUMNS] for x in zip(q, v, a)])
        tau = np.array([pin.rnea(model, data, *x) for x in zip(q, v, a)])
        middle, half = (high + low) / 2, (high - low) / 2
        shares = {
            "position": np.abs(q - middle).max(0) / half,
            "velocity": np.abs(v).max(0) / most["velocity"],
            "acceleration": np.abs(a).max(0) / most["acceleration"],
            "torque": np.abs(tau).max(0) / most["torque"],
        }
        worst = ", ".join(f"{key} {share.max():.3f}" for key, share in shares.items())
        print(f"{name}: {length:.1f} s, condition number {np.linalg.cond(rows):.2f}, shares of the limits: {worst}")
        if given.peaks:
            for key, peak in [("low", q.min(0)), ("high", q.max(0)), ("v", v), ("a", a), ("tau", tau)]:
                peak = peak if peak.ndim == 1 else np.abs(peak).max(0)
                print(f"  {key}: " + " ".join(f"{x:.6f}" for x in peak))


if __name__ == "__main__":
    main()
