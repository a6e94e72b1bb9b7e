#!/usr/bin/env python3
"""Counts what `rig identify` says of sound recordings of arms, and of recordings with one fault.

    pip install -r tests/realism/requirements.txt
    tests/realism/faults.py --rig target/release/rig

The recordings are those of `bench.py`: arms simulated by MuJoCo, each with one flaw of real recorders, which is no fault. The
description is off in every mass by up to 40 %; a payload of 40 % of the arm's last three links is a change of the robot, no
fault either. Then one fault is built in, at a joint drawn by lot. A fault counts as named where a sentence before the fit names
its column, and as stopped where the command refuses to fit. A joint that the fault hardly touches is not drawn: one whose torque
is less than a tenth of the arm's largest, or whose column it changes by less than a tenth in the RMS (a torque that is hardly ever
negative has no sign to lose).

Prints a Markdown table.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
from collections import defaultdict

try:
    import numpy as np

    import recordings
    from bench import CASES
    from recordings import MOTIONS, Plant, engine, recorded, write
except ImportError as error:
    sys.exit(f"faults.py: the package {error.name} is missing; pip install -r tests/realism/requirements.txt installs it.")

PAYLOAD = 0.4  # share of the mass of the last three links
TOUCHED = 0.1  # share of a column that a fault changes at least


def late(rate):
    return int(0.3 * rate)


FAULTS = {  # what is done to q and tau at joints j and k, and the column that has to be named
    "torque reversed": (lambda q, tau, j, k, rate: tau.__setitem__((slice(None), j), -tau[:, j]), "(tau{j}|q{j})"),
    "position reversed": (lambda q, tau, j, k, rate: q.__setitem__((slice(None), j), -q[:, j]), "(tau{j}|q{j})"),
    "position in degrees": (lambda q, tau, j, k, rate: q.__setitem__((slice(None), j), np.degrees(q[:, j])), "q{j}"),
    "torques in mN·m": (lambda q, tau, j, k, rate: tau.__imul__(1000.0), "tau"),
    "torque 0.3 s late": (lambda q, tau, j, k, rate: tau.__setitem__((slice(None), j), np.roll(tau[:, j], late(rate))), "(tau{j}|q{j})"),
    "torques exchanged": (lambda q, tau, j, k, rate: tau.__setitem__((slice(None), [j, k]), tau[:, [k, j]]), "tau{j}"),
    "positions exchanged": (lambda q, tau, j, k, rate: q.__setitem__((slice(None), [j, k]), q[:, [k, j]]), "q{j}"),
    "torque without its sign": (lambda q, tau, j, k, rate: tau.__setitem__((slice(None), j), np.abs(tau[:, j])), "tau{j}"),
}


def loaded(plant):
    """The same plant with a mass on its last link, 0.1 m off its frame each way."""
    import mujoco

    mass = PAYLOAD * sum(m for m, *_ in plant.links[-3:])
    body = plant.model.nbody - 1
    own, place = plant.model.body_mass[body], np.full(3, 0.1)
    plant.model.body_ipos[body] = (own * plant.model.body_ipos[body] + mass * place) / (own + mass)
    plant.model.body_mass[body] = own + mass
    mujoco.mj_setConst(plant.model, mujoco.MjData(plant.model))
    return plant


def pairs(joints):
    """Neighbours in a list, in their order in the arm, the last with the first."""
    return [sorted(pair) for pair in zip(joints, np.roll(joints, -1))]


def change(column, other):
    """Largest change of a joint's column, as a share of its standard deviation."""
    return ((other - column).std(0) / (column.std(0) + 1e-12)).max()


def said(rig, place):
    """Whether the command refused, and its sentences about data at fault."""
    command = [rig, "identify", "--robot", place / "robot.urdf", "--data", place / "train.csv", "--compare", "none", "--as-described"]
    done = subprocess.run([*command, "--out", place / "out", "--force"], capture_output=True, text=True)
    lines = [line for line in done.stderr.splitlines() if "even grid" not in line]
    return done.returncode != 0, "\n".join(lines)


def is_of_data(text):
    words = "wrong sign|reverse|opposite|looks like|too large|too small|behind q|ahead of q|exchanged|in each other|"
    words += "never negative|times what the description|times as large|Gravity (acts|points)|lost its sign|sign was lost|stands for"
    return re.search(words, text) is not None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", default="target/release/rig")
    parser.add_argument("--arm", choices=recordings.ARMS, action="append")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--fault", choices=FAULTS, action="append", help="build in this one, in every recording, and nothing else")
    parser.add_argument("--print", action="store_true", dest="show", help="print every sentence that is counted as wrong")
    chosen = parser.parse_args()
    sound, faulty = defaultdict(lambda: [0, 0, 0]), defaultdict(lambda: [0, 0, 0])
    for arm in chosen.arm or ["elbow", "ur5"]:
        lots = np.random.default_rng(chosen.seed)
        runs = {}
        for number, (flaw, rate, motion, seconds) in enumerate(CASES):
            if (motion, seconds) not in runs:
                make = lambda: MOTIONS[motion](len(recordings.ARMS[arm]), seconds, np.random.default_rng(chosen.seed + 1000))
                runs[motion, seconds] = [plant.run(make()) for plant in (Plant(arm, chosen.seed), loaded(Plant(arm, chosen.seed)))]
            plant = Plant(arm, chosen.seed)
            about = np.random.default_rng(chosen.seed + 5)
            nominal = [(m * about.uniform(0.7, 1.4), c * about.uniform(0.5, 1.5), i * about.uniform(0.5, 1.6)) for m, c, i in plant.links]
            with tempfile.TemporaryDirectory() as folder:
                place = pathlib.Path(folder)
                text = engine.urdf(plant.name, plant.arm, nominal, 2.0 * np.abs(runs[motion, seconds][1][3]).max(0))
                (place / "robot.urdf").write_text(text)
                for name, truth in zip(("as described", "with a payload"), [] if chosen.fault else runs[motion, seconds]):
                    t, q, tau = recorded(truth, flaw, rate, np.random.default_rng(chosen.seed + 1000))
                    write(place / "train.csv", t, q, tau)
                    refused, text = said(chosen.rig, place)
                    sound[name][0] += 1
                    sound[name][1] += is_of_data(text) and not refused
                    sound[name][2] += refused
                    if chosen.show and (refused or is_of_data(text)):
                        print(f"{arm}, {flaw}, {rate} Hz, {motion}, {seconds} s, {name}: {text}", flush=True)
                t, q, tau = recorded(runs[motion, seconds][0], flaw, rate, np.random.default_rng(chosen.seed + 1000))
                strong = np.ptp(tau, 0) > 0.1 * np.ptp(tau, 0).max()
                for fault, (make, column) in FAULTS.items():
                    if fault not in chosen.fault if chosen.fault else number % 3 != list(FAULTS).index(fault) % 3:
                        continue
                    for j, k in pairs(lots.permutation(np.flatnonzero(strong))):
                        other_q, other_tau = q.copy(), tau.copy()
                        make(other_q, other_tau, j, k, rate)
                        if change(q, other_q) + change(tau, other_tau) > TOUCHED:
                            break
                    else:
                        continue
                    write(place / "train.csv", t, other_q, other_tau)
                    refused, text = said(chosen.rig, place)
                    named = re.search(column.format(j=j + 1) + r"\b", text) is not None if column != "tau" else "tau" in text
                    faulty[fault][0] += 1
                    faulty[fault][1] += named and is_of_data(text)
                    faulty[fault][2] += refused and named
                    if chosen.show and not (named and is_of_data(text)):
                        print(f"{arm}, {flaw}, {rate} Hz, {motion}, {seconds} s, {fault} at {j + 1}, {k + 1}: {text}", flush=True)
    print("\n| recording | recordings | a fault is said, the fit goes on | refused |\n|---|---|---|---|")
    for name, counts in sound.items():
        print(f"| {name} | {' | '.join(map(str, counts))} |")
    print("\n| fault | recordings | named | named and refused |\n|---|---|---|---|")
    for name, counts in faulty.items():
        print(f"| {name} | {' | '.join(map(str, counts))} |")


if __name__ == "__main__":
    main()
