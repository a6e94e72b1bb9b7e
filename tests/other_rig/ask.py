#!/usr/bin/env python3
"""Hides effects in recordings of a rig that is not the project's; counts how often `rig diagnose` names them.

    pip install -r tests/other_rig/requirements.txt
    tests/other_rig/ask.py --rig target/release/rig

Prints a line a case as it goes and a Markdown table at the end. A right name is the hidden effect's, or a set that holds it.
An effect counts as below the floor where it raises the RMS that a fit of the standard model leaves by less than 10 %:
the fit is this script's own, to the same motion with and without the effect. Of several hidden together each is
taken alone for this, and the least counts.
"""
import argparse
import json
import math
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from typing import NamedTuple

try:
    import numpy as np

    import cases
    from rig import ROW, record
except ImportError as error:
    sys.exit(f"ask.py: the package {error.name} is missing; pip install -r tests/other_rig/requirements.txt installs it.")

LONGEST = 600  # s, one diagnosis
FLOOR_RISE = 0.1
CORNER = 40.0  # Hz, low-pass of the fit
SLOWEST = 0.005  # rad/s, below which a speed's sign is not known
AROUND = 25  # rows about such a speed that the low-pass smears it into
KINDS = ("effect", "combined", "outside", "nothing", "fault")
FORMATS = {"t": "%.4f", "q1": "%.8f", "qd1": "%.6f", "i1": "%.5f", "ref1": "%.7f", "u1": "%.4f"}


class Answer(NamedTuple):
    case: cases.Case
    rise: float  # of the fit's RMS by the effect, the least of several; NaN where nothing is hidden
    diagnosis: dict  # empty without a verdict
    complaint: str  # why there is none

    @property
    def steps(self):
        return self.diagnosis.get("steps", [])

    @property
    def hidden(self):
        """The library's names of what is hidden."""
        return {hidden.name for hidden in self.case.hidden}

    @property
    def first(self):
        """Whether a right name comes first."""
        return bool(self.steps) and bool(self.hidden & _names(self.steps[0]))

    @property
    def wrong(self):
        """Names that neither are right nor stand for a set that is."""
        return [step["effect"] for step in self.steps if not self.hidden & _names(step)]

    @property
    def found(self):
        return len(self.wrong) < len(self.steps)

    @property
    def exact(self):
        """Whether all right names stand there, each once, and no other."""
        every = all(any(name in _names(step) for step in self.steps) for name in self.hidden)
        return every and not self.wrong and len(self.steps) == len(self.hidden)

    @property
    def remainder(self):
        return self.diagnosis.get("remainder") is not None

    @property
    def above(self):
        return self.rise >= FLOOR_RISE


def _names(step):
    return {step["effect"], *step["set"]}


def _low(values):
    """Without phase; recordings begin and end at rest, so that the ends do not matter."""
    spectrum = np.fft.rfft(values)
    return np.fft.irfft(spectrum / (1 + (np.fft.rfftfreq(len(values), ROW) / CORNER) ** 8), len(values))


def _left(case, payload, columns):
    """RMS that the standard model leaves: of the torque, or of the voltage where it was recorded."""
    q = _low(columns["q1"])
    v = np.gradient(q, ROW)
    if "u1" in columns:
        current = _low(columns["i1"])
        y, x = _low(columns["u1"]), [current, np.gradient(current, ROW), v]
    else:
        y = cases.AMPERE * _low(columns["i1"])
        x = [np.gradient(v, ROW), np.sin(q), v, _low(np.sign(v))]
        if payload:
            # A fit takes a payload over; it shows against the description alone.
            y = y - (case.description["motor_inertia"] + case.description["link_inertia"]) * x[0]
            y, x = y - case.description["gravity"] * x[1], x[2:]
    moves = np.convolve(np.abs(v) <= SLOWEST, np.ones(2 * AROUND + 1), "same") < 0.5
    x = np.column_stack(x)[moves]
    # RMS and not deviation: a constant is an effect and not the standard model's.
    return np.sqrt(np.mean((y[moves] - x @ np.linalg.lstsq(x, y[moves], rcond=None)[0]) ** 2))


def _write(path, columns):
    formats = [FORMATS[name] for name in columns]
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, fmt=formats, delimiter=",", header=",".join(columns), comments="")


def _rise(case):
    """By how much each hidden effect alone raises what the fit leaves of the training motion: the least."""
    rises = []
    for hidden in case.hidden:
        plain = cases.PLAIN._replace(feed_forward=case.rig.feed_forward)
        readings = cases.Readings(**{"noise": case.noise, **hidden.readings})
        left = []
        for rig, reads, touches in (
            (plain._replace(**hidden.rig), readings, hidden.touches[0]),
            (plain, cases.Readings(case.noise, voltage=readings.voltage), None),
        ):
            columns = record(rig, reads, case.train, 10 * case.seed + 1, touches)
            left.append(_left(case, hidden.name == "payload", columns))
        rises.append(left[0] / left[1] - 1)
    return min(rises, default=math.nan)


def ask(program, case, folder, twice):
    """Records the case, asks the program, and compares."""
    folder.mkdir(parents=True, exist_ok=True)
    touches = case.hidden[0].touches if case.kind == "outside" else (None, None)
    runs = {"train.csv": (case.train, 1, touches[0]), "holdout.csv": (case.holdout, 3, touches[1])}
    if twice:
        # A touch does not come again.
        runs["again.csv"] = (case.train, 2, None)
    rise = _rise(case)
    for name, (motion, run, touched) in runs.items():
        columns = record(case.rig, case.readings, motion, 10 * case.seed + run, touched)
        if case.kind == "fault":
            columns = cases.spoil(columns, case.effect, name != "holdout.csv")
        _write(folder / name, columns)
    (folder / "R.toml").write_text(cases.description_text(case.description), encoding="utf-8")
    shutil.rmtree(folder / "out", ignore_errors=True)  # an older answer is none
    command = [program, "diagnose", "--robot", "R.toml", "--data", "train.csv"]
    command += ["--data", "again.csv"] if twice else []
    command += ["--holdout", "holdout.csv", "--out", "out"]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=LONGEST)
        diagnosis = json.loads((folder / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    except subprocess.TimeoutExpired:
        return Answer(case, rise, {}, f"no end within {LONGEST} s")
    except (OSError, json.JSONDecodeError):
        return Answer(case, rise, {}, f"status {done.returncode}: {' '.join(done.stderr.split())}")
    return Answer(case, rise, diagnosis, "")


def parameters(answer):
    """Each parameter of the right name: name, relative error of magnitude, and whether the 95 % interval holds the truth.

    None where it has no interval."""
    for hidden in answer.case.hidden:
        step = next((step for step in answer.steps if step["effect"] == hidden.name), None)
        if step is None:
            continue
        found = {name: (p["value"], p["std"]) for name, p in step["parameters"].items()}
        if "amplitude" not in found and {"cosine", "sine"} <= found.keys():
            (c, c_std), (s, s_std) = found["cosine"], found["sine"]
            size = math.hypot(c, s)
            found["amplitude"] = size, math.hypot(c * (c_std or 0), s * (s_std or 0)) / size if size else None
        for name, truth in hidden.truth.items():
            if name in found and truth:
                value, std = found[name]
                off = abs(value) - abs(truth)
                yield name, off / abs(truth), abs(off) <= 1.96 * std if std else None


def line(answer, seconds):
    case, words = answer.case, [answer.complaint or answer.diagnosis["verdict"]]
    for step in answer.steps:
        words.append("{" + ", ".join(dict.fromkeys([step["effect"], *step["set"]])) + "}")
    interval = {True: "", False: " (outside its interval)", None: " (no interval)"}
    for name, error, held in parameters(answer):
        words.append(f"{name} {100 * error:+.1f} %{interval[held]}")
    if answer.remainder and answer.diagnosis["verdict"] != "remainder":
        words.append("remainder")
    words += [fault["kind"] for fault in answer.diagnosis.get("data_faults", [])]
    rise = "" if math.isnan(answer.rise) else f", {100 * answer.rise:+.0f} % RMS"
    return f"{case.kind}: {case.title}{rise}: {'; '.join(words)} ({seconds:.0f} s)"


def _of(chosen, total):
    return f"{sum(1 for answer in total if chosen(answer))} of {len(total)}"


def table(answers):
    """What is counted, as Markdown."""
    kind = {k: [a for a in answers if a.case.kind == k and a.diagnosis] for k in KINDS}
    rows = []
    if kind["effect"]:
        clear = [a for a in kind["effect"] if a.above]
        errors = [p for a in clear for p in parameters(a)]
        with_interval = [held for _, _, held in errors if held is not None]
        right = [a for a in clear if a.first and not a.wrong]
        rows += [("right name first, effect above the floor", _of(lambda a: a.first, clear)),
                 ("right name first, of any size", _of(lambda a: a.first, kind["effect"])),
                 ("a false name beside the right one", _of(lambda a: a.wrong, [a for a in kind["effect"] if a.found])),
                 ("a false name alone", _of(lambda a: a.wrong, [a for a in kind["effect"] if not a.found])),
                 ("right names alone, yet a remainder said", _of(lambda a: a.remainder, right))]
        if errors:
            median = 100 * statistics.median(abs(error) for _, error, _ in errors)
            rows += [("median error of the parameters", f"{median:.1f} % of {len(errors)}"),
                     ("95 % intervals that hold the truth", f"{sum(with_interval)} of {len(with_interval)}")]
    clear = [a for a in kind["combined"] if a.above]
    named = sum(len(a.steps) for a in kind["combined"])
    rows += [("exactly the right names, effect above the floor", _of(lambda a: a.exact, [a for a in kind["effect"] if a.above])),
             ("several together, each above the floor: exactly the right names", _of(lambda a: a.exact, clear)),
             ("… a right name first", _of(lambda a: a.first, clear)),
             ("several together, of any size: names that are wrong", f"{sum(len(a.wrong) for a in kind['combined'])} of {named}"),
             ("… exactly the right names, yet a remainder said", _of(lambda a: a.remainder, [a for a in clear if a.exact]))]
    nothing, fault = kind["nothing"], kind["fault"]
    rows += [("nothing hidden: something named", _of(lambda a: a.steps, nothing)),
             ("nothing hidden: a remainder said", _of(lambda a: a.remainder, nothing))]
    clear = [a for a in kind["outside"] if a.above]
    silent = _of(lambda a: not a.steps and not a.remainder, clear)
    rows += [("outside the library: a remainder said", _of(lambda a: a.remainder, clear)),
             ("outside the library: said to be explained", _of(lambda a: a.diagnosis["verdict"] == "explained", clear)),
             ("outside the library: neither named nor a remainder", silent),
             ("faults of the data said to be such", _of(lambda a: a.diagnosis["verdict"] == "data-fault", fault))]
    rows.append(("no verdict", _of(lambda a: not a.diagnosis, answers)))
    lines = [f"| {what} | {result} |\n" for what, result in rows if result != "0 of 0"]
    text = "| counted | result |\n| --- | --- |\n" + "".join(lines)
    below = [a for a in kind["effect"] + kind["combined"] + kind["outside"] if not a.above]
    if below:
        text += "\n| below the floor | rise of the RMS | named |\n| --- | --- | --- |\n"
        for a in below:
            text += f"| {a.case.title} | {100 * a.rise:.1f} % | {', '.join(s['effect'] for s in a.steps) or 'nothing'} |\n"
    return text


def chosen_cases(arguments):
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    for kind, effects in (("effect", cases.EFFECTS), ("outside", cases.OUTSIDE)):
        for effect in effects:
            if effect in arguments.effects:
                yield from ((kind, effect, seed) for seed in seeds)
    if "combined" in arguments.effects:
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.combined):
            yield from (("combined", cases.combination(count, seed), seed) for count in (2, 3))
    if "nothing" in arguments.effects:
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.nothing):
            yield from (("nothing", "none", seed, noise) for noise in cases.NOISES)
    if "faults" in arguments.effects:
        yield from (("fault", fault, arguments.first_seed) for fault in cases.FAULTS)


def main():
    every = cases.EFFECTS + cases.OUTSIDE + ["combined", "nothing", "faults"]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", required=True, help="the program")
    parser.add_argument("--seeds", type=int, default=2, help="cases an effect")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--nothing", type=int, default=4, help="seeds with nothing hidden, each at three levels of noise")
    parser.add_argument("--combined", type=int, default=4, help="seeds with two and with three effects hidden together")
    parser.add_argument("--effects", type=lambda text: [effect.strip() for effect in text.split(",")], default=every,
                        help="some of " + ", ".join(every))
    parser.add_argument("--twice", action="store_true", help="record the training motion twice")
    parser.add_argument("--out", type=pathlib.Path, help="keep recordings and reports here, a folder a case")
    arguments = parser.parse_args()
    unknown = [effect for effect in arguments.effects if effect not in every]
    if unknown:
        parser.error(f"--effects: {', '.join(unknown)} is none of {', '.join(every)}.")
    if arguments.seeds < 1 or min(arguments.nothing, arguments.combined) < 0 or arguments.first_seed < 0:
        parser.error("--seeds takes 1 or more, --nothing, --combined and --first-seed take 0 or more.")
    program = shutil.which(arguments.rig)
    if program is None:
        sys.exit(f"ask.py: {arguments.rig} is no program that can be run; cargo build --release makes target/release/rig.")
    program = str(pathlib.Path(program).resolve())
    with tempfile.TemporaryDirectory() as temporary:
        out = arguments.out or pathlib.Path(temporary)
        answers = []
        for chosen in chosen_cases(arguments):
            case = cases.case(*chosen)
            begin = time.monotonic()
            answers.append(ask(program, case, out / case.title.replace(" ", "-"), arguments.twice))
            print(line(answers[-1], time.monotonic() - begin), flush=True)
    print("\n" + table(answers), end="")


if __name__ == "__main__":
    main()
