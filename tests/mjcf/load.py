#!/usr/bin/env python3
"""Loads a fragment that `rig mjcf` wrote with MuJoCo, at joints of the same names, and prints what arrived.

    python3 tests/mjcf/load.py joints.xml pan lift slide roll
"""

import json
import sys
from pathlib import Path

import mujoco

fragment, names = Path(sys.argv[1]), sys.argv[2:]
inner = "".join(f'<body><joint name="{n}" class="{n}"/><geom size="0.1" mass="1"/>' for n in names)
model = mujoco.MjModel.from_xml_string(
    f'<mujoco><include file="joints.xml"/><worldbody>{inner}{"</body>" * len(names)}</worldbody></mujoco>',
    {"joints.xml": fragment.read_bytes()},
)
found = {}
for name in names:
    dof = model.joint(name).dofadr[0]
    found[name] = {
        "armature": float(model.dof_armature[dof]),
        "damping": float(model.dof_damping[dof].flat[0]),
        "frictionloss": float(model.dof_frictionloss[dof]),
        "gear": float(model.actuator(name).gear[0]),
    }
print(json.dumps(found))
