#!/usr/bin/env python3
"""Computes torques of arm.xml and frames.xml with MuJoCo: states.json and frames.json, which the tests of `rig-model` compare
with their own.

    python3 tests/mjcf/check.py            # needs mujoco and numpy; MuJoCo 3 or newer

Of arm.xml the torque is M(q)·a + c(q, v), with the armature and without damping and friction. The fingers are held at their
lower limit. Of frames.xml it is the torque of mj_inverse, with damping. saved.xml is a model of geoms as MuJoCo writes it with all
inertias, and saved.json has the torques of the model before.
"""

import json
from pathlib import Path

import mujoco
import numpy

HERE = Path(__file__).parent
JOINTS = ["pan", "lift", "slide", "roll"]

model = mujoco.MjModel.from_xml_path(str(HERE / "arm.xml"))
data = mujoco.MjData(model)
generator = numpy.random.default_rng(5)
position = [model.joint(name).qposadr[0] for name in JOINTS]
speed = [model.joint(name).dofadr[0] for name in JOINTS]
fingers = [model.joint(name).qposadr[0] for name in ["left_finger", "right_finger"]]
states = []
for _ in range(12):
    q, v, a = (generator.uniform(-1.5, 1.5, 4) for _ in range(3))
    data.qpos[:] = 0.0
    data.qvel[:] = 0.0
    data.qpos[fingers] = 0.01
    data.qpos[position] = q
    data.qvel[speed] = v
    mujoco.mj_forward(model, data)
    inertia = numpy.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, inertia, data.qM) if hasattr(data, "qM") else mujoco.mj_fullM(model, data, inertia)
    acceleration = numpy.zeros(model.nv)
    acceleration[speed] = a
    torque = (inertia @ acceleration + data.qfrc_bias)[speed]
    states.append({"q": q.tolist(), "qd": v.tolist(), "qdd": a.tolist(), "tau": torque.tolist()})
(HERE / "states.json").write_text(json.dumps(states, indent=1) + "\n")


def inverse(model, path):
    """Writes torques of mj_inverse at random states."""
    data = mujoco.MjData(model)
    states = []
    for _ in range(12):
        q, v, a = (generator.uniform(-1.5, 1.5, model.nv) for _ in range(3))
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        states.append({"q": q.tolist(), "qd": v.tolist(), "qdd": a.tolist(), "tau": data.qfrc_inverse.tolist()})
    path.write_text(json.dumps(states, indent=1) + "\n")


inverse(mujoco.MjModel.from_xml_path(str(HERE / "frames.xml")), HERE / "frames.json")

GEOMS = """
<mujoco model="geoms">
  <compiler settotalmass="4"/>
  <default><default class="soft"><joint damping="0.3"/></default></default>
  <worldbody>
    <frame pos="0 0 0.2" euler="10 0 0" childclass="soft">
      <body name="arm">
        <joint name="first" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0.05" size="0.04"/>
        <frame pos="0.3 0 0.05" euler="0 20 0">
          <joint name="second" axis="1 0 0"/>
          <body name="hand">
            <joint name="third" axis="0 0 1"/>
            <geom type="box" size="0.1 0.05 0.02" pos="0.1 0.02 0"/>
            <replicate count="2" offset="0.03 0 0"><body><geom size="0.02"/></body></replicate>
          </body>
        </frame>
      </body>
    </frame>
  </worldbody>
</mujoco>
"""
spec = mujoco.MjSpec.from_string(GEOMS)
spec.compiler.saveinertial = True
model = spec.compile()
(HERE / "saved.xml").write_text(spec.to_xml())
inverse(model, HERE / "saved.json")
