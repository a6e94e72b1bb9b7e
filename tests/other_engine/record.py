#!/usr/bin/env python3
"""Records an arm with a dynamics engine that shares no line with this project: MuJoCo or Pinocchio.

Writes into --out: robot.urdf (geometry; its inertial values are stand-ins, not the arm's), train.csv and holdout.csv
(columns t, q1 ..., tau1 ...: SI, joint side), truth.json (engine, noise put in per joint, and what least squares with
Pinocchio's regressor at the exact motion leaves of the hold-out over that noise: the noise in the data lets no unbiased fit do better on average).

In the arm "mimic" two axes follow a joint (<mimic> in robot.urdf): q of an axis = ratio * q of its joint + offset. The engine
gets every axis, and the torque of a joint is the sum of ratio * torque of its axes.

The motion is a Fourier series over 20 s per joint, 5 harmonics, other coefficients in the hold-out. The engine gives
the torque; friction fv*qd + fc*sgn(qd) and a constant are added by this script. Noise of the torque: Gaussian, below
NOISE_BAND Hz, NOISE_SHARE of the RMS torque of each joint; below the band so that no later low-pass takes it away.
Positions are rounded to ENCODER counts a turn (or metre). Everything is drawn from --seed.
"""
import argparse
import json
import pathlib

import numpy as np

RATE = 500.0
PERIOD = 20.0
RECORDED = 100.0
HARMONICS = 5
NOISE_SHARE = 0.02
NOISE_BAND = 2.0
ENCODER = 2**20

# Modified Denavit-Hartenberg (alpha, a, d), kind, mass.
# UR5: lengths and masses as Universal Robots publishes them; here as a likeness, the inertias are drawn.
UR5 = [
    (0.0, 0.0, 0.08916, "revolute", 3.7),
    (np.pi / 2, 0.0, 0.0, "revolute", 8.393),
    (0.0, -0.425, 0.0, "revolute", 2.275),
    (0.0, -0.39225, 0.10915, "revolute", 1.219),
    (np.pi / 2, 0.0, 0.09465, "revolute", 1.219),
    (-np.pi / 2, 0.0, 0.0823, "revolute", 0.1879),
]
# Panda: lengths as Franka publishes them; masses representative.
PANDA = [
    (0.0, 0.0, 0.333, "revolute", 3.0),
    (-np.pi / 2, 0.0, 0.0, "revolute", 3.0),
    (np.pi / 2, 0.0, 0.316, "revolute", 3.0),
    (np.pi / 2, 0.0825, 0.0, "revolute", 2.5),
    (-np.pi / 2, -0.0825, 0.384, "revolute", 2.5),
    (np.pi / 2, 0.0, 0.0, "revolute", 1.5),
    (np.pi / 2, 0.088, 0.0, "revolute", 0.7),
]

# Six axes; the third turns against the second, the slide follows the fourth.
MIMIC = [
    (0.0, 0.0, 0.3, "revolute", 5.0),
    (np.pi / 2, 0.1, 0.0, "revolute", 4.0),
    (0.0, 0.35, 0.0, "revolute", 3.0),
    (-1.1, 0.1, 0.2, "revolute", 2.5),
    (0.4, 0.15, 0.1, "prismatic", 1.5),
    (np.pi / 2, 0.0, 0.1, "revolute", 0.8),
]
# By axis: the axis that it follows, ratio and offset.
GEARS = {"mimic": {2: (1, -1.0, 0.0), 4: (3, 0.5, 0.1)}}


def projection(axes, gears):
    """M and b: positions of the axes are M @ q + b. Also the axes that are joints."""
    joints = [axis for axis in range(axes) if axis not in gears]
    matrix, shift = np.zeros((axes, len(joints))), np.zeros(axes)
    for axis in range(axes):
        master, ratio, offset = gears.get(axis, (axis, 1.0, 0.0))
        matrix[axis, joints.index(master)], shift[axis] = ratio, offset
    return matrix, shift, joints


def random_arm(generator):
    """Five joints, the second and the last but one prismatic."""
    arm = []
    for i in range(5):
        kind = "prismatic" if i in (1, 3) else "revolute"
        alpha = generator.choice([0.0, np.pi / 2, -np.pi / 2]) if i else 0.0
        arm.append((alpha, generator.uniform(0.0, 0.3), generator.uniform(-0.2, 0.2), kind, generator.uniform(1.0, 6.0)))
    return arm


def bodies(arm, generator):
    """Centre of mass and inertia about it of a box of even density, turned at random."""
    result = []
    for *_, mass in arm:
        size = generator.uniform(0.05, 0.25, 3)
        turn, _ = np.linalg.qr(generator.normal(size=(3, 3)))
        moments = mass / 12.0 * np.array([size[1] ** 2 + size[2] ** 2, size[0] ** 2 + size[2] ** 2, size[0] ** 2 + size[1] ** 2])
        result.append((mass, generator.uniform(-0.1, 0.1, 3), turn @ np.diag(moments) @ turn.T))
    return result


def urdf(name, arm, links, effort=None, gears=None):
    effort = [1e4] * len(arm) if effort is None else effort
    number = lambda values: " ".join(repr(float(v)) for v in values)
    text = [f'<?xml version="1.0"?>\n<robot name="{name}">\n  <link name="base"/>']
    before = "base"
    for i, ((alpha, a, d, kind, _), (mass, centre, inertia)) in enumerate(zip(arm, links), 1):
        origin = (a, -np.sin(alpha) * d, np.cos(alpha) * d)
        text.append(
            f'  <joint name="joint{i}" type="{kind}">\n'
            f'    <origin xyz="{number(origin)}" rpy="{number((alpha, 0.0, 0.0))}"/>\n'
            f'    <parent link="{before}"/>\n    <child link="link{i}"/>\n    <axis xyz="0 0 1"/>\n'
            f'    <limit lower="-3.2" upper="3.2" velocity="20" effort="{float(effort[i - 1])!r}"/>\n{mimic(gears, i - 1)}  </joint>\n'
            f'  <link name="link{i}">\n    <inertial>\n      <mass value="{mass!r}"/>\n'
            f'      <origin xyz="{number(centre)}" rpy="0 0 0"/>\n'
            f'      <inertia ixx="{float(inertia[0, 0])!r}" ixy="{float(inertia[0, 1])!r}" ixz="{float(inertia[0, 2])!r}" '
            f'iyy="{float(inertia[1, 1])!r}" iyz="{float(inertia[1, 2])!r}" izz="{float(inertia[2, 2])!r}"/>\n'
            f"    </inertial>\n  </link>"
        )
        before = f"link{i}"
    text.append("</robot>\n")
    return "\n".join(text)


def mimic(gears, axis):
    if not gears or axis not in gears:
        return ""
    master, ratio, offset = gears[axis]
    return f'    <mimic joint="joint{master + 1}" multiplier="{ratio!r}" offset="{offset!r}"/>\n'


def motion(arm, generator):
    t = np.arange(0.0, RECORDED, 1.0 / RATE)
    w = 2.0 * np.pi / PERIOD * np.arange(1, HARMONICS + 1)[:, None]
    q, qd, qdd = [], [], []
    for *_, kind, _ in arm:
        reach = 1.2 if kind == "revolute" else 0.3
        a, b = generator.normal(size=(2, HARMONICS, 1))
        x = a * np.sin(w * t) + b * np.cos(w * t)
        scale = reach / np.max(np.abs(x.sum(0)))
        v = w * (a * np.cos(w * t) - b * np.sin(w * t))
        q.append(scale * x.sum(0))
        qd.append(scale * v.sum(0))
        qdd.append(scale * (-(w**2) * x).sum(0))
    return t, np.array(q).T, np.array(qd).T, np.array(qdd).T


def torque_of_mujoco(text, q, qd, qdd):
    import mujoco

    compiler = '<mujoco><compiler fusestatic="false" boundmass="0" boundinertia="0" balanceinertia="false"/></mujoco>'
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", compiler + "</robot>"))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    torque = np.zeros_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(model, data)
        torque[k] = data.qfrc_inverse
    return torque


def torque_of_pinocchio(text, q, qd, qdd):
    import pinocchio

    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    return np.array([pinocchio.rnea(model, data, *row) for row in zip(q, qd, qdd)])


def regressor(text, axes, qd, matrix):
    """Inertial parameters of the links, then viscous and Coulomb friction and offset of each joint."""
    import pinocchio

    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    links = np.array([pinocchio.computeJointTorqueRegressor(model, data, *row) for row in zip(*axes)])
    links = np.einsum("aj,sac->sjc", matrix, links)
    n = qd.shape[1]
    friction = np.zeros((len(qd), n, 3 * n))
    for j in range(n):
        friction[:, j, 3 * j : 3 * j + 3] = np.column_stack([qd[:, j], np.sign(qd[:, j]), np.ones(len(qd))])
    return np.concatenate([links, friction], axis=2)


def exact_least_squares(recorded, sigma):
    """RMS residual of the hold-out by joint, over its noise. Rows are weighted by the noise put in."""
    regressors, torque = recorded["train"]
    columns = regressors.shape[2]
    rows = (regressors / sigma["train"][:, None]).reshape(-1, columns)
    size = np.maximum(np.linalg.norm(rows, axis=0), 1e-12)
    found = np.linalg.lstsq(rows / size, (torque / sigma["train"]).ravel(), rcond=1e-10)[0] / size
    regressors, torque = recorded["holdout"]
    return np.sqrt(np.mean((torque - regressors @ found) ** 2, axis=0)) / sigma["holdout"]


def noise(generator, rows, joints):
    white = generator.normal(size=(rows, joints))
    spectrum = np.fft.rfft(white, axis=0)
    spectrum[np.fft.rfftfreq(rows, 1.0 / RATE) > NOISE_BAND] = 0.0
    coloured = np.fft.irfft(spectrum, rows, axis=0)
    return coloured / coloured.std(axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--arm", choices=["ur5", "panda", "random", "mimic"], required=True)
    parser.add_argument("--engine", choices=["mujoco", "pinocchio"], required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    chosen = parser.parse_args()
    generator = np.random.default_rng(chosen.seed)
    arm = {"ur5": UR5, "panda": PANDA, "mimic": MIMIC}.get(chosen.arm) or random_arm(generator)
    links = bodies(arm, generator)
    text = urdf(chosen.arm, arm, links)
    engine = torque_of_mujoco if chosen.engine == "mujoco" else torque_of_pinocchio
    gears = GEARS.get(chosen.arm, {})
    matrix, shift, joints = projection(len(arm), gears)
    n = len(joints)
    own = [arm[axis] for axis in joints]
    viscous, coulomb, offset = generator.uniform(0.5, 3.0, n), generator.uniform(0.5, 3.0, n), generator.uniform(-0.5, 0.5, n)
    chosen.out.mkdir(parents=True, exist_ok=True)
    truth = {"engine": chosen.engine, "arm": chosen.arm, "seed": chosen.seed, "noise_share": NOISE_SHARE, "noise_rms": {}}
    peak = np.zeros(n)
    recorded, sigmas = {}, {}
    for name in ("train", "holdout"):
        t, q, qd, qdd = motion(own, generator)
        axes = (q @ matrix.T + shift, qd @ matrix.T, qdd @ matrix.T)
        torque = engine(text, *axes) @ matrix + viscous * qd + coulomb * np.sign(qd) + offset
        sigma = NOISE_SHARE * np.sqrt(np.mean(torque**2, axis=0))
        torque = torque + sigma * noise(generator, len(t), n)
        truth["noise_rms"][name] = sigma.tolist()
        few = slice(None, None, int(RATE / (10.0 * NOISE_BAND)))
        recorded[name], sigmas[name] = (regressor(text, [x[few] for x in axes], qd[few], matrix), torque[few]), sigma
        peak = np.maximum(peak, np.abs(torque).max(axis=0))
        count = np.array([2.0 * np.pi / ENCODER if kind == "revolute" else 1.0 / ENCODER for *_, kind, _ in own])
        table = np.column_stack([t, np.round(q / count) * count, torque])
        header = ",".join(["t"] + [f"q{i}" for i in range(1, n + 1)] + [f"tau{i}" for i in range(1, n + 1)])
        np.savetxt(chosen.out / f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.12g")
    truth["exact_least_squares"] = exact_least_squares(recorded, sigmas).tolist()
    truth["friction"] = {"viscous": viscous.tolist(), "coulomb": coulomb.tolist(), "offset": offset.tolist()}
    stand_in = [(1.0, np.zeros(3), np.eye(3) * 0.01)] * len(arm)
    effort = 2.0 * np.abs(matrix) @ peak
    (chosen.out / "robot.urdf").write_text(urdf(chosen.arm, arm, stand_in, effort, gears))
    (chosen.out / "true.urdf").write_text(urdf(chosen.arm, arm, links, effort, gears))
    (chosen.out / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")


if __name__ == "__main__":
    main()
