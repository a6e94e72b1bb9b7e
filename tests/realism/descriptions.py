#!/usr/bin/env python3
"""Counts what `rig diagnose` says of robots that lack nothing: each URDF of a package, simulated by its own description.

    pip install -r tests/realism/requirements.txt
    tests/realism/descriptions.py --rig target/release/rig [NAME ...]

Every URDF of the package example-robot-data that `rig base` reads, and that has limits, is excited by two designed motions and
simulated with white noise: torques 0.3 % of the largest joint's RMS, positions 1e-5 rad. The first motion is given alone or twice, the
second is held back. The description is exact, so that any effect, remainder or fault is false.

Prints a Markdown table.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
except ImportError as error:
    sys.exit(f"descriptions.py: the package {error.name} is missing; pip install -r tests/realism/requirements.txt installs it.")

NOISE = 0.003  # share of the RMS of the torque that is largest
POSITION_NOISE = 1e-5  # rad


def package():
    """URDF files of example-robot-data, which pip installs below the prefix of cmeel."""
    files = (path for root in sys.path for path in pathlib.Path(root).glob("cmeel.prefix/share/example-robot-data/robots/**/*.urdf"))
    return sorted(set(files))


def run(rig, *arguments):
    return subprocess.run([rig, *map(str, arguments)], capture_output=True, text=True)


def last_line(done):
    return (done.stderr or done.stdout).strip().splitlines()[-1].replace("|", "/")[:160]


def recorded(rig, urdf, place):
    """Writes once.csv, again.csv and other.csv; what a command refused instead, or None."""
    for seed in (1, 2):
        done = run(rig, "excite", "--robot", urdf, "--seed", seed, "--out", place / f"motion{seed}.csv")
        if done.returncode:
            return last_line(done)
    simulate = ["simulate", "--robot", urdf, "--trajectory"]
    done = run(rig, *simulate, place / "motion1.csv", "--out", place / "clean.csv")
    if done.returncode:
        return last_line(done)
    table = np.genfromtxt(place / "clean.csv", delimiter=",", names=True)
    torques = [table[name] for name in table.dtype.names if name.startswith("tau")]
    noise = NOISE * max(np.sqrt(np.mean(torque**2)) for torque in torques)
    for seed, (motion, name) in enumerate([(1, "once"), (1, "again"), (2, "other")]):
        noises = ["--noise-torque", noise, "--noise-position", POSITION_NOISE, "--seed", seed + 1]
        run(rig, *simulate, place / f"motion{motion}.csv", *noises, "--out", place / f"{name}.csv")
    return None


def verdict(rig, urdf, place, data):
    """Verdict, what was named, the largest residual over its floor, and seconds."""
    began = time.monotonic()
    given = [part for name in data for part in ("--data", place / f"{name}.csv")]
    done = run(rig, "diagnose", "--robot", urdf, *given, "--holdout", place / "other.csv", "--out", place / "out", "--force")
    seconds = time.monotonic() - began
    if done.returncode:
        return last_line(done), "", "", seconds
    found = json.loads((place / "out" / "diagnosis.json").read_text())
    named = ", ".join(f"{step['effect']} at {step['joint']}" for step in found["steps"])
    ratios = [left["after"] / left["floor"] for left in found.get("left") or [] if left.get("floor")]
    return found["verdict"], named, f"{max(ratios):.2f}" if ratios else "", seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", required=True, type=pathlib.Path)
    parser.add_argument("names", nargs="*", help="stems of the URDF files; all where none is given")
    asked = parser.parse_args()
    rig = asked.rig.resolve()
    print("| robot | recordings | verdict | named | residual / floor | s |\n| --- | --- | --- | --- | --- | --- |")
    for urdf in package():
        if asked.names and urdf.stem not in asked.names or run(rig, "base", "--robot", urdf).returncode:
            continue
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder)
            refused = recorded(rig, urdf, place)
            if refused:
                print(f"| {urdf.stem} | | {refused} | | | |", flush=True)
                continue
            for data in (["once"], ["once", "again"]):
                said, named, ratio, seconds = verdict(rig, urdf, place, data)
                print(f"| {urdf.stem} | {' + '.join(data)} | {said} | {named} | {ratio} | {seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
