"""Measures inverse dynamics from Python: rig_dynamics over an array beside Pinocchio's loop, seven joints.

Run: python host/python/speed.py (needs the packages of `pip install 'rig_dynamics[test]'`).
"""

import sys
import time
from pathlib import Path

import numpy as np
import pinocchio

import rig_dynamics as rig

sys.path.insert(0, str(Path(__file__).parent / "tests"))
from arms import random_urdf, states  # noqa: E402

SAMPLES, REPEATS = 100_000, 7


def best(work):
    """Return the shortest of several times, in microseconds per sample."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / SAMPLES


text = random_urdf(7, 1)
robot = rig.Robot.from_urdf(text)
model = pinocchio.buildModelFromXML(text)
data = model.createData()
q, qd, qdd = states(7, SAMPLES, 1)


def loop():
    tau = np.empty_like(q)
    for k in range(SAMPLES):
        tau[k] = pinocchio.rnea(model, data, q[k], qd[k], qdd[k])
    return tau


difference = np.abs(robot.inverse_dynamics(q, qd, qdd) - loop()).max()
print(f"largest difference of the torques: {difference:.1e} N*m")
one = best(lambda: robot.inverse_dynamics(q, qd, qdd, threads=1))
every = best(lambda: robot.inverse_dynamics(q, qd, qdd))
singles = [own.astype(np.float32) for own in (q, qd, qdd)]
single = best(lambda: robot.inverse_dynamics(*singles, threads=1))
other = best(loop)
print(f"rig_dynamics, one thread:     {one:.3f} us a sample")
print(f"  the same in float32:        {single:.3f} us a sample")
print(f"rig_dynamics, all processors: {every:.3f} us a sample")
print(f"Pinocchio {pinocchio.__version__}, a loop:      {other:.3f} us a sample")
