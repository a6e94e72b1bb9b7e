"""Plain least squares on the Stäubli TX40, with a dynamics library that is not ours: what its published errors are of.

    python tx40.py RECORDINGS/staubli_tx40

Repeats the published treatment (figaroh-plus, examples/staubli_TX40: Butterworth filter of order 4 forward and back,
differences, parallel decimation with a Chebyshev filter, least squares weighted by joint) with 70 % of the rows and prints
the relative error, percent by joint, on the other 30 %: of the 7.5 s in which the arm moves, and of the whole 9 s.
Needs numpy, scipy and pin (pip).
"""

import argparse
import pathlib

import numpy as np
import pinocchio as pin
from scipy import signal

RATE = 1000.0  # Hz
ORDER = 4
TO_MOTOR = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
TO_MOTOR[5, 4] = 32.0  # turning joint 5 turns motor 6
ZERO = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])  # rad
# Slower rows are left out in the published treatment, rad/s by joint.
SLOW = np.array([0.05009095, 0.05009095, 0.07504916, 0.0715585, 0.05585054, 0.12217305])
JOINTS, COLUMNS = 6, 14  # ten of the link, drive inertia, viscous, Coulomb, constant
VISCOUS = 11


def rows_of(folder, cutoff, decimation):
    """By joint: regressor (last three columns: motor 6) and torque, decimated."""
    data = np.loadtxt(folder / "motor_1kHz.csv", delimiter=",", skiprows=1)
    model = pin.buildModelFromUrdf(str(folder / "tx40.urdf"))
    store = model.createData()
    q = data[:, 1:7] @ np.linalg.inv(TO_MOTOR).T
    q = signal.filtfilt(*signal.butter(ORDER, 2 * cutoff / RATE), q, axis=0) + ZERO
    v = np.gradient(q, 1 / RATE, axis=0)
    a = np.gradient(v, 1 / RATE, axis=0)
    inside = slice(5 * ORDER, -5 * ORDER)
    q, v, a, tau = q[inside], v[inside], a[inside], (data[:, 7:13] @ TO_MOTOR)[inside]
    full = np.zeros((JOINTS, len(q), JOINTS * COLUMNS + 3))
    for k in range(len(q)):
        links = pin.computeJointTorqueRegressor(model, store, q[k], v[k], a[k])
        for i in range(JOINTS):
            full[:, k, i * COLUMNS : i * COLUMNS + 10] = links[:, 10 * i : 10 * i + 10]
    one = np.ones(len(q))
    for j in range(JOINTS):
        own = [a[:, j], v[:, j], np.sign(v[:, j]), one]
        full[j, :, j * COLUMNS + 10 : (j + 1) * COLUMNS] = np.column_stack(own)
    full[5, :, 5 * COLUMNS + 10] = 0.0  # the inertia of motor 6 stands below
    motor = np.sign(v[:, 4] + v[:, 5])
    full[4, :, -3:] = np.column_stack([a[:, 5], v[:, 5], motor])
    full[5, :, -3:] = np.column_stack([a[:, 4] + a[:, 5], v[:, 4], motor])
    thin = lambda x: signal.decimate(x, decimation, axis=0, zero_phase=True)
    return [thin(x) for x in full], [thin(tau[:, j]) for j in range(JOINTS)]


def independent(rows):
    """Columns of all rows that are independent of those before them."""
    stacked = np.vstack(rows)
    present = np.flatnonzero(np.linalg.norm(stacked, axis=0) > 1e-3)
    size = np.abs(np.diag(np.linalg.qr(stacked[:, present], mode="r")))
    return present[size > 1e-6 * size.max()]


def weighted(rows, torque):
    """Least squares, then each joint's rows over what they left."""
    x = np.linalg.lstsq(np.vstack(rows), np.concatenate(torque), rcond=None)[0]
    left = [np.sqrt(np.mean((t - r @ x) ** 2)) for r, t in zip(rows, torque)]
    rows, torque = [r / s for r, s in zip(rows, left)], [t / s for t, s in zip(torque, left)]
    return np.linalg.lstsq(np.vstack(rows), np.concatenate(torque), rcond=None)[0]


def errors(rows, torque, last, slow_ones_too):
    """Percent by joint on the last 30 % of the rows before `last`, learnt from those before."""
    until = int(0.7 * last)
    fast = [abs(r[:, j * COLUMNS + VISCOUS]) >= SLOW[j] for j, r in enumerate(rows)]
    here = lambda x, j, part: x[j][part][slow_ones_too | fast[j][part]]
    split = lambda x, part: [here(x, j, part) for j in range(JOINTS)]
    kept = independent(split(rows, slice(None)))
    learnt, held = slice(0, until), slice(until, last)
    x = weighted([r[:, kept] for r in split(rows, learnt)], split(torque, learnt))
    ratio = lambda r, t: 100 * np.linalg.norm(t - r[:, kept] @ x) / np.linalg.norm(t)
    return [ratio(r, t) for r, t in zip(split(rows, held), split(torque, held))]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    folder = parser.parse_args().folder
    for cutoff, decimation in [(40.0, 10), (100.0, 20)]:
        rows, torque = rows_of(folder, cutoff, decimation)
        for seconds in (7.5, 9.0):
            last = min(int(seconds * RATE / decimation), len(torque[0]))
            for all_rows in (True, False):
                found = " ".join(f"{e:6.1f}" for e in errors(rows, torque, last, all_rows))
                which = "all rows " if all_rows else "fast rows"
                print(f"{cutoff:5.0f} Hz, one row in {decimation}, {seconds} s, {which} {found}")


if __name__ == "__main__":
    main()
