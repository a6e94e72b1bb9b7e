#!/usr/bin/env python3
"""Identifies arms from flawed recordings; compares with plain least squares at the best cut-off of nine.

    pip install -r tests/realism/requirements.txt
    tests/realism/bench.py --rig target/release/rig

Each case is one flaw, rate and motion of `recordings.py`. The error is the RMS difference between the torque that the
identified parameters give at the EXACT motion of another, unflawed run and the motors' torque there, with the recorder's
torque noise (1 %) on top: what a hold-out of the same recorder would show. Least squares (Pinocchio's regressor, zero-phase
filters, two passes of weights) has nine cut-offs to choose from, by that error: it knows the answer. Rows slower than
0.05 rad/s or rad are left out of the error: MuJoCo's dry friction is softened there.

Prints a line a case and a Markdown table. --most fails where a joint's ratio is above it.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile
import tomllib

try:
    import numpy as np
    import pinocchio as pin
    from scipy import signal

    import recordings
    from recordings import MOTIONS, NOISE, Plant, engine, recorded, write
except ImportError as error:
    sys.exit(f"bench.py: the package {error.name} is missing; pip install -r tests/realism/requirements.txt installs it.")

CASES = [  # flaw, Hz, motion, s
    ("clean", 1000, "fourier", 20),
    ("white", 1000, "fourier", 20),
    ("counts13", 1000, "fourier", 20),
    ("counts17", 1000, "fourier", 20),
    ("jitter_sample", 1000, "fourier", 20),
    ("jitter_stamp", 1000, "fourier", 20),
    ("filtered20", 1000, "fourier", 20),
    ("filtered50", 1000, "fourier", 20),
    ("smooth30", 1000, "fourier", 20),
    ("counts13", 100, "fourier", 20),
    ("counts15", 200, "fourier", 20),
    ("white", 5000, "fourier", 20),
    ("counts13", 5000, "fourier", 20),
    ("counts15", 1000, "trapezoids", 20),
    ("jitter_sample", 500, "trapezoids", 20),
    ("filtered20", 500, "trapezoids", 20),
    ("clean", 5000, "trapezoids", 20),
    ("counts13", 1000, "fourier", 6),
]
HELD_BACK = 12.0  # s
OWN = 4  # columns a joint beside its link: viscous, Coulomb, constant, drive inertia


def regressor(model, q, qd, qdd):
    data, n = model.createData(), q.shape[1]
    links = np.array([pin.computeJointTorqueRegressor(model, data, *row) for row in zip(q, qd, qdd)])
    own = np.zeros((len(q), n, OWN * n))
    for j in range(n):
        own[:, j, OWN * j : OWN * (j + 1)] = np.column_stack([qd[:, j], np.sign(qd[:, j]), np.ones(len(q)), qdd[:, j]])
    return np.concatenate([links, own], axis=2)


def least_squares(model, t, q, torque, cutoff, slow):
    dt, n = np.mean(np.diff(t)), q.shape[1]
    rate = 1.0 / dt
    low_pass = lambda hz, x: signal.sosfiltfilt(signal.butter(4, min(hz, 0.45 * rate), fs=rate, output="sos"), x, axis=0)
    q = low_pass(cutoff, q)
    qd = np.gradient(q, dt, axis=0)
    rows = regressor(model, q, qd, np.gradient(qd, dt, axis=0))
    band = min(cutoff, 10.0, 0.45 * rate)
    step = max(1, int(0.4 * rate / band))
    columns = rows.reshape(len(q), -1)
    live = np.any(columns != 0.0, axis=0)
    kept = np.zeros((len(range(0, len(q), step)), columns.shape[1]))
    kept[:, live] = low_pass(band, columns[:, live])[::step]
    kept, torque, qd = kept.reshape(len(kept), n, -1), low_pass(band, torque)[::step], qd[::step]
    ends = int(3.0 / (band * dt) / step) + 1
    kept, torque, keep = kept[ends:-ends], torque[ends:-ends], np.abs(qd[ends:-ends]) > slow
    weight = np.ones(n)
    for _ in range(2):
        a = np.concatenate([kept[keep[:, j], j] / weight[j] for j in range(n)])
        b = np.concatenate([torque[keep[:, j], j] / weight[j] for j in range(n)])
        size = np.maximum(np.linalg.norm(a, axis=0), 1e-12)
        found = np.linalg.lstsq(a / size, b, rcond=1e-8)[0] / size
        weight = np.array([np.std(torque[keep[:, j], j] - kept[keep[:, j], j] @ found) for j in range(n)])
    return found


def identified(folder, n):
    """Link parameters from the written URDF, whose frames are the user's; friction and drive inertia from the TOML."""
    model = pin.buildModelFromUrdf(str(folder / "identified.urdf"))
    joints = [i for i in range(1, model.njoints)][-n:]
    values = [model.inertias[i].toDynamicParameters() for i in joints]
    for joint in tomllib.loads((folder / "identified.toml").read_text())["joint"]:
        friction, drive = joint.get("friction", {}), joint.get("drive", {})
        inertia = drive.get("rotor_inertia", 0.0) * drive.get("gear_ratio", 1.0) ** 2
        values.append([friction.get("viscous", 0.0), friction.get("coulomb", 0.0), friction.get("offset", 0.0), inertia])
    return np.concatenate(values)


def case(plant, rig, train, held, flaw, rate, seed, place):
    """Errors by joint of least squares at its best cut-off and of `rig identify`, or the sentence of its refusal."""
    generator = np.random.default_rng(seed + 1000)
    t, q, torque = recorded(train, flaw, rate, generator)
    write(place / "train.csv", t, q, torque)
    about = np.random.default_rng(seed + 5)
    nominal = [(m * about.uniform(0.7, 1.4), c * about.uniform(0.5, 1.5), i * about.uniform(0.5, 1.6)) for m, c, i in plant.links]
    text = engine.urdf(plant.name, plant.arm, nominal, 2.0 * np.abs(train[3]).max(0))
    (place / "robot.urdf").write_text(text)
    model = pin.buildModelFromXML(text)
    few = slice(500, None, 25)
    exact, wanted = regressor(model, *held[:3, few]), held[3, few]
    fast = np.abs(held[1, few]) > 0.05

    def error(values):
        left = wanted - exact @ values
        square = [np.mean(left[fast[:, j], j] ** 2) / np.mean(wanted[fast[:, j], j] ** 2) for j in range(plant.joints)]
        return np.sqrt(NOISE**2 + np.array(square))

    slow = 0.05 * np.sqrt(np.mean(train[1] ** 2, 0))
    tried = [error(least_squares(model, t, q, torque, hz, slow)) for hz in np.geomspace(1.5, min(0.4 * rate, 150), 9)]
    best = min(tried, key=lambda e: np.mean(np.log(e)))
    command = [rig, "identify", "--robot", place / "robot.urdf", "--data", place / "train.csv", "--compare", "none"]
    done = subprocess.run([*command, "--out", place / "out"], capture_output=True, text=True)
    return best, done.stderr.strip() if done.returncode else error(identified(place / "out", plant.joints))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", default="target/release/rig")
    parser.add_argument("--arm", choices=recordings.ARMS, action="append")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="cases whose name holds this")
    parser.add_argument("--most", type=float, default=np.inf, help="highest ratio of a joint")
    chosen = parser.parse_args()
    table, worst = [], 0.0
    for arm in chosen.arm or ["elbow", "ur5"]:
        plant, runs = Plant(arm, chosen.seed), {}
        for flaw, rate, motion, seconds in CASES:
            name = f"{flaw}, {rate} Hz, {motion}, {seconds} s"
            if chosen.only not in name:
                continue
            if (motion, seconds) not in runs:
                generator = np.random.default_rng(chosen.seed + 1000)
                runs[motion, seconds] = [plant.run(MOTIONS[motion](plant.joints, s, generator)) for s in (seconds, HELD_BACK)]
            with tempfile.TemporaryDirectory() as place:
                best, found = case(plant, chosen.rig, *runs[motion, seconds], flaw, rate, chosen.seed, pathlib.Path(place))
            if isinstance(found, str):
                worst = np.inf
                print(f"{arm}, {name}: refused: {found}", flush=True)
                table.append((arm, name, best, "refused"))
                continue
            ratio = found / best
            worst = max(worst, ratio.max())
            print(f"{arm}, {name}: by joint {np.round(ratio, 2)}, least squares {np.round(100 * best, 2)} %", flush=True)
            table.append((arm, name, best, f"{ratio.max():.2f}"))
    print("\n| arm | recording | least squares, best cut-off, % | worst joint of `rig` over it |\n|---|---|---|---|")
    for arm, name, best, ratio in table:
        print(f"| {arm} | {name} | {' '.join(f'{100 * e:.2f}' for e in best)} | {ratio} |")
    if worst > chosen.most:
        sys.exit(f"bench.py: a ratio of {worst:.2f} is above {chosen.most}.")


if __name__ == "__main__":
    main()
