#!/usr/bin/env python3
"""Computes torques, accelerations and energies of an arm in which joints mimic others, by Pinocchio or MuJoCo.

Writes robot.urdf (with its true inertias and <mimic>) and states.json into --out: positions, velocities and accelerations
of the joints at random states; for each state the torque of the joints, the inertia matrix, and the energy. The engine
gets the whole tree, in which every axis is a joint. M maps joints to axes (see record.py): torques are M^T tau, the inertia
matrix M^T A M.
"""
import argparse
import json
import pathlib

import numpy as np

from record import GEARS, MIMIC, bodies, projection, torque_of_mujoco, torque_of_pinocchio, urdf

STATES = 12


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    chosen = parser.parse_args()
    import pinocchio

    generator = np.random.default_rng(chosen.seed)
    gears = GEARS["mimic"]
    links = bodies(MIMIC, generator)
    whole = urdf("mimic", MIMIC, links)
    matrix, shift, joints = projection(len(MIMIC), gears)
    n = len(joints)
    q, qd, qdd = (generator.uniform(-reach, reach, (STATES, n)) for reach in (1.5, 3.0, 8.0))
    axes = q @ matrix.T + shift, qd @ matrix.T, qdd @ matrix.T
    torque = {
        "pinocchio": torque_of_pinocchio(whole, *axes) @ matrix,
        "mujoco": torque_of_mujoco(whole, *axes) @ matrix,
    }
    model = pinocchio.buildModelFromXML(whole)
    data = model.createData()
    inertia, energy = [], []
    for k in range(STATES):
        square = pinocchio.crba(model, data, axes[0][k])
        square = np.triu(square) + np.triu(square, 1).T
        inertia.append((matrix.T @ square @ matrix).ravel().tolist())
        energy.append(pinocchio.computeMechanicalEnergy(model, data, axes[0][k], axes[1][k]))
    chosen.out.mkdir(parents=True, exist_ok=True)
    (chosen.out / "robot.urdf").write_text(urdf("mimic", MIMIC, links, None, gears))
    states = {"q": q, "qd": qd, "qdd": qdd, **torque}
    table = {name: values.tolist() for name, values in states.items()} | {"inertia": inertia, "energy": energy}
    (chosen.out / "states.json").write_text(json.dumps(table) + "\n")


main()
