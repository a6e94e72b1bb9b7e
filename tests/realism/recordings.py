"""Arms simulated by MuJoCo in closed loop, and recorded with the flaws of real recorders.

MuJoCo shares no line with this project. A computed-torque controller without friction follows the reference, so the joints
lag and stick as real ones do. The recorder then samples the simulation at its own rate and adds one flaw.
Left out: elastic joints, backlash, delays between topics, lost rows.
"""
import pathlib
import sys

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "other_engine"))
import record as engine  # noqa: E402  (arms, bodies and URDF of tests/other_engine)

STEP = 2e-4  # s, of the simulation and its controller
NOISE = 0.01  # of the recorded torque, share of its RMS
LOOP = 6.0  # Hz, bandwidth of the controller
ELBOW = [
    (0.0, 0.0, 0.3, "revolute", 4.0),
    (np.pi / 2, 0.0, 0.0, "revolute", 3.0),
    (0.0, 0.4, 0.0, "revolute", 2.0),
]
ARMS = {"elbow": ELBOW, "ur5": engine.UR5, "panda": engine.PANDA}


class Plant:
    """One arm with friction and drive inertia drawn from a seed."""

    def __init__(self, name, seed):
        import mujoco

        generator = np.random.default_rng(seed)
        self.name, self.arm, self.mujoco = name, ARMS[name], mujoco
        self.joints = n = len(self.arm)
        self.links = engine.bodies(self.arm, generator)
        size = np.array([np.sqrt(sum(mass for *_, mass in self.arm[i:])) for i in range(n)])
        compiler = '<mujoco><compiler fusestatic="false" boundmass="0" boundinertia="0" balanceinertia="false"/></mujoco>'
        text = engine.urdf(name, self.arm, self.links).replace("</robot>", compiler + "</robot>")
        self.model = model = mujoco.MjModel.from_xml_string(text)
        model.opt.timestep = STEP
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        model.jnt_limited[:] = 0
        model.dof_damping[:] = generator.uniform(0.3, 1.0, n) * size
        model.dof_frictionloss[:] = generator.uniform(0.3, 1.0, n) * size
        model.dof_armature[:] = generator.uniform(0.02, 0.15, n) * size
        model.dof_solref[:] = [2e-3, 1.0]

    def run(self, motion):
        """True position, velocity, acceleration and motor torque at every step along a reference."""
        mujoco, model = self.mujoco, self.model
        data, wanted = mujoco.MjData(model), mujoco.MjData(model)
        q, qd, qdd = motion
        data.qpos[:], data.qvel[:] = q[0], qd[0]
        mujoco.mj_forward(model, data)
        inertia = np.zeros((self.joints, self.joints))
        mujoco.mj_fullM(model, data, inertia)
        kp, kd = np.diag(inertia) * (2 * np.pi * LOOP) ** 2, np.diag(inertia) * 2 * (2 * np.pi * LOOP)
        out = np.zeros((4, len(q), self.joints))
        unconstrained = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        for k in range(len(q)):
            wanted.qpos[:], wanted.qvel[:], wanted.qacc[:] = q[k], qd[k], qdd[k]
            model.opt.disableflags |= unconstrained
            mujoco.mj_inverse(model, wanted)
            model.opt.disableflags &= ~unconstrained
            torque = wanted.qfrc_inverse + kp * (q[k] - data.qpos) + kd * (qd[k] - data.qvel)
            data.qfrc_applied[:] = torque
            mujoco.mj_forward(model, data)
            out[:, k] = data.qpos, data.qvel, data.qacc, torque
            mujoco.mj_step2(model, data)
        return out


def fourier(n, seconds, generator, reach=1.2, base=0.1, harmonics=5):
    """A Fourier series of 0.1 to 0.5 Hz a joint."""
    t = np.arange(0, seconds, STEP)
    w = 2 * np.pi * base * np.arange(1, harmonics + 1)[:, None]
    q, qd, qdd = [], [], []
    for _ in range(n):
        a, b = generator.normal(size=(2, harmonics, 1))
        x = (a * np.sin(w * t) + b * np.cos(w * t)).sum(0)
        scale = reach * generator.uniform(0.5, 1.0) / np.max(np.abs(x))
        q.append(scale * x)
        qd.append(scale * (w * (a * np.cos(w * t) - b * np.sin(w * t))).sum(0))
        qdd.append(scale * (-(w**2) * (a * np.sin(w * t) + b * np.cos(w * t))).sum(0))
    return tuple(np.array(x).T for x in (q, qd, qdd))


def trapezoids(n, seconds, generator, reach=1.2):
    """Point to point with speeds of trapezoids and short dwells, as industrial arms move."""
    rows = len(np.arange(0, seconds, STEP))
    q, qd, qdd = np.zeros((rows, n)), np.zeros((rows, n)), np.zeros((rows, n))
    here, k = np.zeros(n), 0
    while k < rows:
        goal, duration = generator.uniform(-reach, reach, n), generator.uniform(0.8, 1.8)
        ramp = 0.25 * duration
        s = np.arange(int(duration / STEP)) * STEP
        top = 1.0 / (duration - ramp)
        speed = np.clip(np.minimum(s / ramp, (duration - s) / ramp), 0, 1) * top
        acceleration = np.where(s < ramp, top / ramp, np.where(s > duration - ramp, -top / ramp, 0.0))
        way = np.cumsum(speed) * STEP
        end = min(k + len(s), rows)
        part = slice(0, end - k)
        q[k:end] = here + np.outer(way[part], goal - here)
        qd[k:end], qdd[k:end] = np.outer(speed[part], goal - here), np.outer(acceleration[part], goal - here)
        here, k = here + way[-1] * (goal - here), end
        dwell = min(k + int(generator.uniform(0.1, 0.4) / STEP), rows)
        q[k:dwell], k = here, dwell
    return q, qd, qdd


MOTIONS = {"fourier": fourier, "trapezoids": trapezoids}


def recorded(truth, flaw, rate, generator):
    """Time stamps, positions and torques as a recorder writes them. Flaws: clean; white; counts<bits>; jitter_sample (rows
    taken up to 0.3 ms off even stamps); jitter_stamp (stamps off even rows); filtered<Hz> (noise and position through a
    zero-phase low-pass); smooth<Hz> (position and torque through one causal low-pass)."""
    exact = np.arange(truth.shape[1]) * STEP
    joints = truth.shape[2]
    t = np.arange(0.0, exact[-1] - 2e-3, 1.0 / rate) + 1e-3
    taken = t + (generator.uniform(-3e-4, 3e-4, len(t)) if flaw == "jitter_sample" else 0.0)
    stamps = t + (generator.uniform(-3e-4, 3e-4, len(t)) if flaw == "jitter_stamp" else 0.0)
    q = CubicSpline(exact, truth[0])(taken)
    torque = np.array([np.interp(taken, exact, truth[3][:, j]) for j in range(joints)]).T
    torque = torque + NOISE * np.sqrt(np.mean(torque**2, 0)) * generator.normal(size=torque.shape)
    if flaw.startswith("counts"):
        count = 2 * np.pi / 2 ** int(flaw[6:])
        q = np.round(q / count) * count
    elif flaw == "white":
        q = q + 2e-4 * generator.normal(size=q.shape)
    elif flaw.startswith("filtered"):
        low_pass = signal.butter(2, float(flaw[8:]), fs=rate, output="sos")
        q = signal.sosfiltfilt(low_pass, q + 5e-4 * generator.normal(size=q.shape), axis=0)
    elif flaw.startswith("smooth"):
        low_pass = signal.butter(2, float(flaw[6:]), fs=rate, output="sos")
        rest = signal.sosfilt_zi(low_pass)[:, :, None]
        q = q + 5e-5 * generator.normal(size=q.shape)
        q, _ = signal.sosfilt(low_pass, q, axis=0, zi=rest * q[0])
        torque, _ = signal.sosfilt(low_pass, torque, axis=0, zi=rest * torque[0])
    return stamps, q, torque


def write(path, t, q, torque):
    n = q.shape[1]
    header = ["t"] + [f"q{i + 1}" for i in range(n)] + [f"tau{i + 1}" for i in range(n)]
    np.savetxt(path, np.column_stack([t, q, torque]), delimiter=",", header=",".join(header), comments="", fmt="%.9g")
