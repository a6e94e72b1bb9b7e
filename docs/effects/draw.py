"""Draws the pictures of docs/effects/.

Hides each effect in recordings of the emulated rig (rig-bench), diagnoses them with the program, and keeps the figure of the
effect. The coupling of two joints is simulated with the description of EDDA. Prints the verdict of each rig.

    python3 docs/effects/draw.py                  # all; builds the two programs first
    python3 docs/effects/draw.py backlash spring  # these alone
    RIG_PROGRAMS=target/debug python3 docs/effects/draw.py    # with programs that are built already

Needs Python 3.8 alone.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PICTURES = Path(__file__).resolve().parent
# The effect's name, and the seed of its rig: the first at which the effect is large enough to be named.
SEEDS = {
    "stribeck": 1,
    "asymmetric_coulomb": 1,
    "quadratic_drag": 3,
    "load_friction": 1,
    "position_friction": 1,
    "presliding": 1,
    "viscous_warmup": 1,
    "cogging": 1,
    "torque_ripple": 1,
    "gear_eccentricity": 1,
    "backlash": 1,
    "joint_elasticity": 1,
    "encoder_eccentricity": 2,
    "current_offset": 1,
    "torque_saturation": 1,
    "measurement_delay": 2,
    "gravity_tilt": 1,
    "payload": 1,
    "spring": 1,
    "drive_deadzone": 1,
    "torque_offset": 1,
}
COUPLED = "inertia_coupling"
COUPLING = """
[[effect]]
kind = "inertia_coupling"
joint = "{joint}"
other = "{other}"
inertia = {inertia}
centripetal = 0.0
viscous = 0.0
"""


def programs() -> Path:
    """Returns the folder of the programs, built if it is not given."""
    given = os.environ.get("RIG_PROGRAMS")
    if given:
        return Path(given).resolve()
    subprocess.run(["cargo", "build", "--release", "-p", "rig", "-p", "rig-bench"], cwd=ROOT, check=True)
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "release"


def run(program: Path, *words) -> None:
    """Runs a program, and shows what it printed if it fails."""
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{program.name} {' '.join(map(str, words))}\n{done.stdout}{done.stderr}")


def emulated(folder: Path, name: str, place: Path) -> tuple:
    """Records the emulated rig with one hidden effect: description, training recordings, hold-out."""
    words = ["--effects", name, "--seeds", 1, "--first-seed", SEEDS[name], "--nothing", 0]
    run(folder / "rig-bench", *words, "--train", 60, "--holdout", 30, "--keep", "--out", place)
    case = place / "0001"
    return case / "robot.toml", [case / "train.csv", case / "repeat.csv"], case / "holdout.csv"


def coupled(folder: Path, place: Path) -> tuple:
    """Simulates EDDA with a coupling of its two joints: description, training recordings, hold-out."""
    rig, plain, true = folder / "rig", place / "edda.toml", place / "true.toml"
    run(rig, "init", "edda", "--out", plain)
    names = [line.split('"')[1] for line in plain.read_text().splitlines() if line.startswith("name")][1:]
    true.write_text(plain.read_text() + COUPLING.format(joint=names[0], other=names[1], inertia=0.4))
    for k, (motion, seed) in enumerate([(1, 1), (1, 2), (2, 3)], 1):
        path = place / f"motion{motion}.toml"
        if not path.exists():
            run(rig, "excite", "--robot", plain, "--seed", motion, "--out", path)
        noise = ["--noise-torque", 0.5, "--noise-position", 1e-5, "--seed", seed]
        run(rig, "simulate", "--robot", true, "--trajectory", path, *noise, "--out", place / f"run{k}.csv")
    return plain, [place / "run1.csv", place / "run2.csv"], place / "run3.csv"


def draw(folder: Path, name: str, place: Path) -> str:
    """Makes the picture of an effect; returns what was found."""
    robot, training, holdout = coupled(folder, place) if name == COUPLED else emulated(folder, name, place)
    words = [word for path in training for word in ("--data", path)]
    found = place / "found"
    run(folder / "rig", "diagnose", "--robot", robot, *words, "--holdout", holdout, "--out", found)
    result = json.loads((found / "diagnosis.json").read_text())
    steps = result["steps"]
    said = f"{result['verdict']}: {', '.join(' or '.join(step['set']) for step in steps) or 'no effect'}"
    named = [k for k, step in enumerate(steps, 1) if name in step["set"]]
    if not named:
        return f"{said}; NO PICTURE, try another seed"
    picture = found / f"effect-{named[0]}.svg"
    if not picture.exists():
        # No coordinate shows it: the residual of each model does.
        picture = found / "gap-1.svg"
    shutil.copyfile(picture, PICTURES / f"{name}.svg")
    return said


def main() -> None:
    wanted = sys.argv[1:] or [*SEEDS, COUPLED]
    folder = programs()
    for name in wanted:
        with tempfile.TemporaryDirectory() as place:
            print(f"{name}: {draw(folder, name, Path(place))}", flush=True)


main()
